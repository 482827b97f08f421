"""Cameras in this machine's plugs. No device can be had here: /sys is a made-up tree and the camera a made-up one."""

from itertools import permutations

import cv2
import pytest

from tests.support.plugged_cameras import V4L2_PATHS, Webcam, plug_in
from touchline.core.errors import BadInput, NotFound, Unavailable
from touchline.images import read_in_process
from touchline.sources import SourceContext, source_from_url
from touchline.sources.v4l2 import V4l2Source, find_device, list_devices

AROUND = SourceContext(read=read_in_process)


@pytest.fixture
def machine(tmp_path, monkeypatch):
    monkeypatch.setattr(V4l2Source, "root", tmp_path)
    return tmp_path


@pytest.fixture
def webcam(machine, monkeypatch):
    """The camera that is opened, whichever is asked for."""
    plug_in(machine, 0)
    one = Webcam()
    monkeypatch.setattr(V4l2Source, "opener", staticmethod(lambda node: one))
    return one


def test_every_camera_is_listed_once_with_what_tells_it_from_others(machine):
    plug_in(machine, 0, plug="1-2", name="HD Webcam", serial="A1B2C3")
    plug_in(machine, 2, plug="1-3.1", name="Cheap Cam", serial="", maker="1234", product="5678")
    first, second = list_devices(machine)
    assert (first.node, first.model, first.serial) == (
        "/dev/video0",
        "HD Webcam (046d:082d)",
        "A1B2C3",
    )
    assert first.port == "pci-0000:00:14.0-usb-0:2:1.0-video-index0"
    assert first.address == "v4l2:///dev/v4l/by-id/usb-046d_HD_Webcam_A1B2C3-video-index0"
    assert (second.node, second.serial) == ("/dev/video2", "")
    assert second.address == "v4l2:///dev/v4l/by-path/pci-0000:00:14.0-usb-0:3.1:1.0-video-index0"


def test_a_camera_is_found_by_number_by_identity_and_by_plug(machine):
    plug_in(machine, 4)
    for target in ("4", "/dev/video4", *list_devices(machine)[0].links):
        assert find_device(target, machine).node == "/dev/video4"
    with pytest.raises(NotFound) as refused:
        find_device("7", machine)
    assert "v4l2:///dev/v4l/by-id/" in refused.value.fix
    with pytest.raises(NotFound):
        find_device("5", machine)  # its metadata is no picture


@pytest.mark.parametrize("target", V4L2_PATHS)
def test_only_cameras_are_opened(machine, target):
    plug_in(machine, 0)
    with pytest.raises(BadInput) as refused:
        find_device(target, machine)
    assert refused.value.reason == "bad-source"


def test_a_link_that_leads_elsewhere_is_no_camera(machine):
    plug_in(machine, 0)
    (machine / "dev/v4l/by-id/evil").symlink_to("/etc/passwd")
    with pytest.raises(NotFound):
        find_device("/dev/v4l/by-id/evil", machine)


@pytest.mark.parametrize(
    "serial", ["SN0001", "200901010001", "00000000", "0", "01.00.00", "1111", ""]
)
def test_a_serial_number_that_every_piece_bears_is_none(machine, serial):
    plug_in(machine, 0, serial=serial)
    assert list_devices(machine)[0].serial == ""


def test_two_cameras_with_one_serial_number_are_told_apart_by_their_plugs(machine):
    plug_in(machine, 0, plug="1-2", serial="A1B2C3")
    plug_in(machine, 2, plug="1-3", serial="A1B2C3")
    first, second = (device.identity for device in list_devices(machine))
    assert first.serial == second.serial == "" and first.differs_from(second)


@pytest.mark.parametrize("order", list(permutations(range(4))))
@pytest.mark.parametrize("plugs", [("1-1", "1-2", "1-3", "1-4"), ("2-4", "1-1.1", "1-1.2", "1-3")])
def test_cameras_plugged_in_in_any_order_are_never_mistaken(tmp_path, order, plugs):
    """Two with numbers of their own, two alike; the latter are who they are by their plugs."""
    kinds = [{"serial": "AAA111"}, {"serial": "BBB222"}, {"serial": "SN0001"}, {"serial": "SN0001"}]
    before, after = tmp_path / "before", tmp_path / "after"
    for i in range(4):
        plug_in(before, 2 * i, plug=plugs[i], **kinds[i])
    for number, i in enumerate(order):  # other numbers, other plugs
        plug_in(after, 2 * number, plug=plugs[number], **kinds[i])
    known = {i: device.identity for i, device in enumerate(list_devices(before))}
    found = {order[number]: device.identity for number, device in enumerate(list_devices(after))}
    for i, identity in known.items():
        for j, other in found.items():
            if identity.differs_from(other) is None:
                # nothing at all tells them apart
                alike = {i, j} == {2, 3} and identity.port == other.port
                assert i == j or alike
    assert all(known[i].differs_from(found[i]) is None for i in (0, 1))


def test_a_camera_gives_frames_and_says_which_it_is(webcam, machine):
    source = source_from_url("v4l2://0", AROUND)
    assert tuple(source.read().size) == (640, 480)
    assert (
        source.identity() == list_devices(machine)[0].identity
        and source.identity().serial == "A1B2C3"
    )
    webcam.gone = True
    with pytest.raises(Unavailable) as refused:
        source.read()
    assert refused.value.reason == "camera-silent"


@pytest.mark.parametrize(
    ("options", "format"),
    [
        ("", "YUYV"),
        ("?size=640x480", "YUYV"),
        ("?size=1280x720", "MJPG"),
        ("?size=1280x720&format=YUYV", "YUYV"),
        ("?size=640x480&format=MJPG", "MJPG"),
    ],
)
def test_large_pictures_come_compressed_unless_told_otherwise(webcam, options, format):
    source_from_url(f"v4l2://0{options}", AROUND)
    assert webcam.get(cv2.CAP_PROP_FOURCC) == cv2.VideoWriter_fourcc(*format)


def test_format_comes_before_size_and_size_before_rate(webcam):
    source_from_url("v4l2://0?size=1280x720&fps=60", AROUND)
    order = [prop for prop, _ in webcam.sets]
    assert order == [
        cv2.CAP_PROP_FOURCC,
        cv2.CAP_PROP_FRAME_WIDTH,
        cv2.CAP_PROP_FRAME_HEIGHT,
        cv2.CAP_PROP_FPS,
        cv2.CAP_PROP_CONVERT_RGB,
    ]


def test_compressed_pictures_stay_as_they_come_and_a_damaged_one_is_left_out(webcam):
    webcam.damaged = 3
    source = source_from_url("v4l2://0?size=1280x720", AROUND)
    frame = source.read()
    assert (
        frame.jpeg.endswith(b"\xff\xd9")
        and tuple(frame.size) == (1280, 720)
        and webcam.damaged == 0
    )
    assert frame.pixels.shape == (720, 1280, 3)
    source.set_control("resolution", "640x480")
    assert tuple(source.read().size) == (640, 480)
    webcam.damaged = 1000
    with pytest.raises(Unavailable):
        source.read()


def test_a_driver_that_decodes_all_the_same_is_let_do_so(webcam):
    webcam.always_decodes = True
    source = source_from_url("v4l2://0?size=1280x720", AROUND)
    frames = [source.read() for _ in range(2)]
    assert all(not one.jpeg and one.pixels.shape == (720, 1280, 3) for one in frames)
    assert webcam.values[cv2.CAP_PROP_CONVERT_RGB] == 1


@pytest.mark.parametrize(
    "size", ["1280", "x", "0x0", "1280x720x3", "99999x99999", "-1x5", "١٢٨٠x٧٢٠"]
)
def test_a_size_that_is_none_is_refused(webcam, size):
    with pytest.raises(BadInput) as refused:
        source_from_url(f"v4l2://0?size={size}", AROUND)
    assert refused.value.reason == "bad-option"


def test_a_camera_in_use_elsewhere_is_told(webcam):
    webcam.there = False
    with pytest.raises(Unavailable) as refused:
        source_from_url("v4l2://0", AROUND)
    assert refused.value.reason == "camera-busy" and "group video" in refused.value.fix


def test_controls_are_what_the_camera_says(webcam):
    controls = {one.name: one for one in source_from_url("v4l2://0", AROUND).controls()}
    assert list(controls) == ["exposure", "gain", "white_balance", "frame_rate", "resolution"]
    exposure = controls["exposure"]
    assert (exposure.value, exposure.unit, exposure.automatic) == (15_600, "µs", True)
    assert (controls["white_balance"].value, controls["white_balance"].automatic) == (4600, True)
    assert controls["gain"].automatic is None and controls["resolution"].value == "640x480"
    del webcam.values[cv2.CAP_PROP_GAIN]
    assert "gain" not in [one.name for one in source_from_url("v4l2://0", AROUND).controls()]


def test_a_setting_by_hand_ends_the_automatic_and_is_read_back_as_the_camera_took_it(webcam):
    source = source_from_url("v4l2://0", AROUND)
    exposure = source.set_control("exposure", 5_000)
    assert (exposure.value, exposure.automatic) == (5_000, False)
    # the most that this camera has
    assert source.set_control("exposure", 9_000_000).value == 204_700
    assert source.set_control("exposure", "auto").automatic is True
    assert source.set_control("white_balance", 5000).value == 5000
    assert source.set_control("gain", 300).value == 255
    assert source.set_control("frame_rate", 15).value == 15


def test_another_resolution_gives_other_frames(webcam):
    source = source_from_url("v4l2://0", AROUND)
    assert source.set_control("resolution", "1280x720").value == "1280x720"
    assert tuple(source.read().size) == (1280, 720)
    with pytest.raises(BadInput, match="still 1280x720"):
        source.set_control("resolution", "3840x2160")


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("exposure", -1),
        ("exposure", float("nan")),
        ("exposure", float("inf")),
        ("exposure", "long"),
        ("exposure", True),
        ("exposure", None),
        ("gain", "auto"),
        ("gain", [1]),
        ("frame_rate", 0),
        ("resolution", "big"),
        ("resolution", 720),
        ("resolution", None),
        ("white_balance", 1e9),
    ],
)
def test_a_value_that_cannot_be_is_refused(webcam, name, value):
    source = source_from_url("v4l2://0", AROUND)
    before = source.controls()
    with pytest.raises(BadInput) as refused:
        source.set_control(name, value)
    assert refused.value.reason == "bad-control" and source.controls() == before


def test_the_real_back_end_says_that_there_is_no_such_device():
    assert not V4l2Source.opener("/dev/video999").isOpened()
