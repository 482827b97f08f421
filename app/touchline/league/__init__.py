"""The league's geometry over UDP multicast: ours to teams, and what others publish.

    packet_camera.py    a calibration → the one-term lens that a packet can hold, with the error that teams can expect
    packet.py           calibrations → one packet, and which cameras are left out, and why
    ball_models.py      how the ball rolls and hops, as a packet says it
    received.py         what another publisher sent, as JSON, and where it contradicts what we publish
    live.py             the publisher's thread, and the listener's
    claims.py           what teams receive, as claims about a version and about the site
    service.py          both of them while the server runs, as its saved settings say

Nothing is sent or received before it is switched on. A failing network is retried for ever; the failure is reported
with its remedy.
"""
