"""publish and absorb: the league's geometry to its multicast group and from it, without a server."""

import json
import time
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from touchline.cli import files
from touchline.cli.console import say
from touchline.cli.requests import AsJson, own_fields
from touchline.core.errors import TouchlineError
from touchline.league.config import NetworkConfig, PublishingConfig
from touchline.league.geometry_listener import GeometryListener
from touchline.league.geometry_packet import PublishedCamera, geometry_packet, published_cameras
from touchline.league.multicast import MulticastSender
from touchline.league.multicast_address import GROUP, PORT, MulticastAddress
from touchline.league.received import received_json

GroupOption = Annotated[str, typer.Option("--group", help="The multicast group.")]
PortOption = Annotated[int, typer.Option("--port", min=1, max=65535, help="Its UDP port.")]
InterfaceOption = Annotated[str, typer.Option("--interface", metavar="NAME|ADDRESS", help="Network interface. By "
                                              "default the system chooses.")]
JOIN_S = 5.0


def publish(
    calibrations: Annotated[list[Path], typer.Argument(metavar="CAL.json…", help="One calibration from calibrate for "
                                                       "each camera.")],
    every: Annotated[float | None, typer.Option("--every", metavar="S", min=0.1, max=60, help="Send repeatedly at "
                                                "this interval. By default once.")] = None,
    group: GroupOption = GROUP, port: PortOption = PORT, interface: InterfaceOption = "",
    ttl: Annotated[int, typer.Option("--ttl", min=0, max=255, help="0 for this machine, 1 for the local network.")] = 1,
    camera_id: Annotated[list[int] | None, typer.Option("--camera-id", min=0, max=2**32 - 1, help="Camera number, in "
                                                        "the order of the files. By default that of the "
                                                        "region.")] = None,
    limit: Annotated[float, typer.Option("--limit-mm", min=0, help="A camera that teams would receive with a larger "
                                         "error is refused.")] = NetworkConfig.limit_mm,
    approve: Annotated[bool, typer.Option("--approve", help="Send it anyway.")] = False,
) -> None:
    """Send field and cameras to the multicast group of the league."""
    known = [replace(files.read_calibration(path), camera=str(path)) for path in calibrations]
    numbers = dict(zip(map(str, calibrations), camera_id or (), strict=False))
    approved = {str(path): one.id for path, one in zip(calibrations, known, strict=True)} if approve else {}
    config = PublishingConfig(enabled=True, group=group, port=port, interface=interface, ttl=ttl,
                              interval_s=every or NetworkConfig.interval_s, limit_mm=limit, numbers=numbers,
                              approved=approved)
    cameras = published_cameras(known, config)
    for one in cameras:
        if one.problem is not None:
            raise one.problem  # all or nothing: half of a field's cameras is a field that half its robots leave
    packet = geometry_packet(cameras)
    assert packet is not None  # every camera is sent
    with closing(MulticastSender(config.address)) as sender:
        sender.check()
        for one in cameras:
            print(f"{one.name}: camera {one.number} of {one.calibration.field['name']}, {_error_for_teams(one)}")
            for warning in () if one.packet is None else one.packet.warnings(one.name):
                if warning.reason != "packet-error":
                    print(f"  Warning: {warning.text} {warning.fix}")
        print(f"{len(packet)} bytes to {group}, port {port}{f', interface {interface}' if interface else ''}.",
              flush=True)
        _send(sender, packet, every)


def absorb(
    seconds: Annotated[float, typer.Option("--for", metavar="S", min=0.1, max=3600, help="Listening time.")] = 5.0,
    folder: Annotated[Path | None, typer.Option("--folder", metavar="DIR", help="Write the newest packet of each "
                                                "sender to this folder, for import.")] = None,
    group: GroupOption = GROUP, port: PortOption = PORT, interface: InterfaceOption = "",
    fields: Annotated[Path | None, typer.Option("--fields", metavar="DIR", help="Folder with your own fields.")] = None,
    as_json: AsJson = False,
) -> None:
    """Listen to the group and list the senders of geometry."""
    known = tuple(own_fields(fields).values())
    listener = GeometryListener(MulticastAddress(group, port, interface))
    try:
        _wait_joined(listener)
        time.sleep(seconds)
        senders = listener.publishers
    finally:
        listener.close()
    found = [received_json(sender, known, ()) for sender in senders]
    if as_json:
        print(json.dumps(found, allow_nan=False, indent=1))
    else:
        for one in found:
            _print_sender(one)
    if not senders:
        say(f"No sender was detected in {seconds:g} s. Check that the interface is in the network of the field "
            "(--interface).")
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        for sender in senders:
            if sender.data:
                files.write_bytes(folder / f"{sender.id}.pb", sender.data)


def _send(sender: Any, packet: bytes, every: float | None) -> None:
    if every is None:
        sender.send(packet)
        return
    failed = False
    try:
        while True:
            try:
                sender.send(packet)
                if failed:
                    say("Sending continues.")
                failed = False
            except TouchlineError as trouble:
                if not failed:
                    say(f"{trouble} Trying again.")
                failed = True
            time.sleep(every)
    except KeyboardInterrupt:
        return


def _wait_joined(listener: Any) -> None:
    end = time.monotonic() + JOIN_S
    while not listener.joined.wait(0.05):
        if listener.problem is not None:
            raise listener.problem
        if time.monotonic() > end:
            return


def _print_sender(one: dict[str, Any]) -> None:
    print(f"{one['address']}, port {one['port']}, {one['source']}: {one['packets']} packets, {one['geometries']} with "
          f"geometry{_unread(one)}")
    if one["problem"] is not None:
        print(f"  {one['problem']['what']} {one['problem']['fix']}")
    if one["field"] is not None:
        known = one["field"]["name"] if one["field"]["known"] else "unknown field"
        print(f"  field {one['field']['length_mm']:g} × {one['field']['width_mm']:g} mm, {known}")
    for camera in one["cameras"]:
        if camera["problem"] is not None:
            print(f"  camera {camera['camera_id']}: {camera['problem']['what']}")
        else:
            x, y, z = camera["position_mm"]
            print(f"  camera {camera['camera_id']} at {x:.0f}, {y:.0f}, {z:.0f} mm, focal length "
                  f"{camera['focal_px']:.1f} px, distortion {camera['distortion']:.4f}")


def _unread(one: dict[str, Any]) -> str:
    refused = f", {one['refused']} refused ({one['refusal']})" if one["refused"] else ""
    return refused + (f", {one['skipped']} not read: too many" if one["skipped"] else "")


def _error_for_teams(one: PublishedCamera) -> str:
    """Say what teams receive of a camera."""
    figures = one.to_json()
    expected, loss = figures["expected"], figures["loss"]
    if expected is None:
        return f"error unknown; {loss['worst_mm']:.1f} mm at most from the calibration"
    hat = expected.get("hat")
    tops = "" if hat is None else (f", {hat['rms']:.1f} mm at {hat['z_mm']:g} mm above it" if hat.get("known", True)
                                   else ", unknown above it: the camera height is unknown")
    return f"teams receive it with an expected error of {expected['rms']:.1f} mm on the carpet{tops}"
