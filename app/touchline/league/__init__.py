"""The league's geometry over UDP multicast: publish ours, and receive what others publish.

    multicast_address.py    group, port, interface and TTL; what this machine's network allows
    multicast.py            packets out: MulticastSender(address).send(data), shared by geometry and detections;
                            packets in, each with its sender's address
    geometry_packet.py      calibrations → one packet, with the error in mm that the league's one-term lens causes
    publisher.py            a thread that sends the newest packet every few seconds, and at once after a change
    geometry_listener.py    a thread that keeps the newest whole geometry of each other publisher, within limits
    received.py             what was received, as JSON, and where it contradicts what we publish
    config.py, publishing.py    publisher and listener, switched on and off by one configuration

Nothing is sent or received before it is switched on. A failing network is retried for ever; the failure is reported
with its remedy.
"""
