"""What is said to a whole network at once: the league's geometry over UDP multicast, and what others say there.

    route.py      which group, by which interface, how far; what this machine has
    group.py      packets out: Group(route).send(data), for geometry now and for whatever else the league puts there
    ear.py        packets in, each with where it came from
    geometry.py   calibrations → one packet, with what the league's one-term lens loses of each in mm
    publisher.py  says the newest packet every few seconds, and at once when something changed
    absorber.py   who else publishes: the newest whole geometry of each sender, under limits
    heard.py      what was heard, in plain JSON, and where it contradicts what we say
    plan.py, publishing.py    all of it switched on and off as an operator says

Nothing is sent and nothing is listened to before somebody asks for it. A network that fails is tried again for ever,
and what failed is told with its cure.
"""
