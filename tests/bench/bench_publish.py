"""How soon an activation is on the air, and what a packet weighs. Command: python tests/bench/bench_publish.py

A real server on a data folder of its own; a listener with a socket of its own on the loopback's multicast. From sending
POST …/activate to hearing the packet with that calibration, 100 activations to and fro between two versions. Then the
bytes of a packet for the league's fields, and what listening to a full house costs: eight cameras' detections at 70 Hz.
"""

import json
import resource
import socket
import sys
import tempfile
import time
from contextlib import closing
from pathlib import Path

import numpy as np

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.support.activation import activate_despite
from tests.support.exported import example, model_of
from tests.support.group_listener import Listener, free_group, said
from tests.support.servers import Line, form, served
from tests.support.ssl_listener import Packet
from tests.support.ssl_messages import changed
from tests.support.waiting import until
from touchline.formats.ssl_field import field_to_wire
from touchline.league.live import GeometryListener
from touchline.league.packet import PublishingConfig, geometry_packet, published_cameras
from touchline.network.address import MulticastAddress
from touchline.ssl_protocol.protobuf import decode, encode
from touchline.ssl_protocol.ssl_vision_pb2 import (
    SSL_DetectionFrame,
    SSL_DetectionRobot,
    SSL_GeometryData,
    SSL_WrapperPacket,
)
from touchline.store.fields import load_fields
from touchline.workflows import interchange

TIMES = 100


def heard_after_activation(name: str) -> list[float]:
    """ms from the request to the packet. name: of a model with at least two examples."""
    way = free_group()
    with (
        tempfile.TemporaryDirectory() as folder,
        served(Path(folder) / "data") as url,
        closing(Line(url)) as line,
        Listener(**way) as ear,
    ):
        assert (
            line.json(
                "POST", "/cameras", {"id": "north", "source": "sim://table?size=320x256&fps=5"}
            )[0]
            == 201
        )
        versions = []
        for index in (0, 1):
            data = interchange.export(example(name, index), "json").data
            versions.append(
                json.loads(line.ask("POST", "/calibrations/import", *form(data))[2])["id"]
            )
        despite = {id: {"despite": [*activate_despite(url, id), "live-image"]} for id in versions}
        line.json(
            "PUT", "/publishing", {"enabled": True, "interval_s": 60, "limit_mm": 1000, **way}
        )
        took, seen = [], focal(ear.receive().data)
        for i in range(TIMES):
            begun = time.perf_counter()
            id = versions[i % 2]
            assert line.json("POST", f"/calibrations/{id}/activate", despite[id])[0] == 200
            while (now := focal(ear.receive().data)) == seen:
                pass
            took.append(1000 * (time.perf_counter() - begun))
            seen = now
        return took


def focal(data: bytes) -> float:
    return Packet.FromString(data).geometry.calib[0].focal_length


def weights() -> None:
    (calib,) = decode(
        SSL_WrapperPacket,
        geometry_packet(published_cameras([example("ssl", 0)], PublishingConfig())),
    ).geometry.calib
    for name in ("ssl-div-a", "ssl-div-b"):
        for cameras in (1, 4, 8):
            calibs = [changed(calib, camera_id=i) for i in range(cameras)]
            geometry = SSL_GeometryData(field=field_to_wire(load_fields()[name]), calib=calibs)
            data = encode(SSL_WrapperPacket(geometry=geometry))
            print(f"{name}, {cameras} cameras: {len(data)} bytes")


def listening() -> None:
    way, robot = (
        free_group(),
        SSL_DetectionRobot(
            confidence=1, robot_id=3, x=1, y=2, orientation=0.5, pixel_x=5, pixel_y=6
        ),
    )
    frame = encode(
        SSL_WrapperPacket(
            detection=SSL_DetectionFrame(
                frame_number=1,
                t_capture=1,
                t_sent=1,
                camera_id=0,
                robots_yellow=(robot,) * 11,
                robots_blue=(robot,) * 11,
            )
        )
    )
    listener = GeometryListener(MulticastAddress(**way))
    listener.joined.wait(20)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vision:
        said(frame, **way, sock=vision)
        until(lambda: listener.datagrams == 1)
        count, before = 5000, resource.getrusage(resource.RUSAGE_SELF)
        for i in range(count):
            vision.sendto(frame, (way["group"], way["port"]))
            if i % 50 == 49:
                time.sleep(0.02)
        until(lambda: listener.datagrams >= count)
        after = resource.getrusage(resource.RUSAGE_SELF)
    spent = (after.ru_utime - before.ru_utime) + (after.ru_stime - before.ru_stime)
    (sender,) = listener.senders
    listener.close()
    print(
        f"{count} detections of {len(frame)} bytes sent and heard by one process: {1e6 * spent / count:.0f} µs of "
        f"processor time each, {sender.skipped} left unread; {560 * spent / count:.1%} of a core at 560 a second"
    )


if __name__ == "__main__":
    for name in ("ssl", "brown-conrady"):
        took = heard_after_activation(name)
        assert model_of(name, 0).focal_px != model_of(name, 1).focal_px
        print(
            f"{name}: activation to packet, {TIMES} times: median {np.median(took):.0f} ms, p95 "
            f"{np.percentile(took, 95):.0f} ms, worst {max(took):.0f} ms"
        )
    weights()
    listening()
