"""GigE Vision through Aravis: a camera on the wire (Debian's simulated one, another process) and the library's own."""

import socket
import subprocess
import sys
import threading
import time
from contextlib import closing

import numpy as np
import pytest

from tests.support.industrial import GvCamera, held, need_aravis, opened
from touchline.core.errors import BadInput, NotFound, TouchlineError, Unavailable
from touchline.sources import Identity, SourceContext, source_from_url
from touchline.sources.industrial import aravis, aravis_library
from touchline.sources.industrial.camera import DiscoveredCamera, find_camera

FAKE = "aravis://Fake_1?fps=100"


@pytest.fixture(scope="module")
def gv():
    camera = GvCamera()
    yield camera
    camera.close()


@pytest.fixture
def fake():
    need_aravis()
    camera = source_from_url(FAKE, SourceContext())
    yield camera
    camera.close()


@pytest.mark.parametrize("target", [GvCamera.SERIAL, f"Aravis-Fake-{GvCamera.SERIAL}", "127.0.0.1"])
def test_a_camera_on_the_network_is_found_by_serial_name_or_address(gv, target):
    with closing(opened(f"aravis://{target}")) as camera:
        identity = camera.identity()
        assert (identity.address, identity.serial, identity.model) == (
            f"aravis://{target}",
            gv.SERIAL,
            "Aravis Fake",
        )
        assert tuple(camera.read().size) == (256, 256)


def test_frames_come_whole_over_the_network(gv):
    with closing(opened("aravis://127.0.0.1?fps=20")) as camera:
        frames = [camera.read() for _ in range(5)]
        assert all(
            frame.pixels.shape == (256, 256, 3) and not frame.pixels.flags.writeable
            for frame in frames
        )
        assert any((frame.pixels != frames[0].pixels).any() for frame in frames)


def test_settings_reach_the_camera_and_stay_there(gv):
    with closing(opened("aravis://127.0.0.1")) as camera:
        assert camera.set_control("exposure", 2000).value == pytest.approx(2000, abs=1)
        assert camera.set_control("width", 320).value == 320
        assert tuple(camera.read().size) == (320, 256)
    with closing(opened("aravis://127.0.0.1")) as again:
        controls = {control.name: control for control in again.controls()}
        assert (
            controls["exposure"].value == pytest.approx(2000, abs=1)
            and controls["width"].value == 320
        )
        again.set_control("width", 256)


def test_a_camera_that_is_in_use_is_said_to_be(gv):
    with closing(opened("aravis://127.0.0.1")), pytest.raises(TouchlineError) as refused:
        source_from_url("aravis://127.0.0.1", SourceContext())
    assert (
        refused.value.reason in ("camera-busy", "bad-control")
        and "other program" in refused.value.fix
    )


@pytest.mark.long
def test_a_camera_that_another_program_uses_is_said_to_be_and_is_free_soon_after_that_one_died(gv):
    program = (
        "import sys; from touchline.sources import SourceContext, source_from_url as source\n"
        "camera = source('aravis://127.0.0.1', SourceContext()); camera.read(); print('has it', flush=True)\n"
        "while True: camera.read()"
    )
    other = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    try:
        assert other.stdout.readline() == "has it\n"
        with pytest.raises(TouchlineError) as refused:
            source_from_url("aravis://127.0.0.1", SourceContext())
        assert (
            refused.value.reason in ("camera-busy", "bad-control")
            and "other program" in refused.value.fix
        )
    finally:
        other.kill()  # it cannot say good-bye: the camera waits for its heartbeat, then lets go
        other.communicate()
    opened("aravis://127.0.0.1").close()


def test_a_camera_that_goes_is_told_and_comes_back(gv):
    with closing(opened("aravis://127.0.0.1")) as camera:
        camera.read()
        gv.stop()
        with pytest.raises(Unavailable) as gone:
            while True:  # what was under way may still come
                camera.read()
        assert gone.value.reason == "camera-silent"
        start = time.monotonic()
    with pytest.raises(Unavailable) as off:
        source_from_url("aravis://127.0.0.1", SourceContext())
    assert off.value.reason == "camera-off"
    # alone 0.01 s; the library itself would take 15 s for its good-bye and to ask
    assert time.monotonic() - start < 8
    gv.start()
    with closing(opened("aravis://127.0.0.1")) as back:
        assert tuple(back.read().size) == (256, 256)


def test_a_camera_is_told_from_a_machine_that_is_silent_or_talks_of_something_else(gv):
    assert aravis.responds("127.0.0.1")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.2", aravis.PORT))
        assert not aravis.responds("127.0.0.2")
        other.settimeout(10)
        asked = {other.recv(100) for _ in range(2)}
        assert asked == {aravis.ASK}

        def babble():
            for _ in range(2):
                _, who = other.recvfrom(100)
                other.sendto(b"\x00\x00\x00\x81", who)

        talking = threading.Thread(target=babble)
        talking.start()
        assert not aravis.responds("127.0.0.2")
        talking.join()
    assert not aravis.responds("127.0.0.2")  # nobody listens


def test_a_name_that_nobody_has_lists_those_who_answer(gv):
    start = time.monotonic()
    with pytest.raises(NotFound) as refused:
        source_from_url("aravis://GV99", SourceContext())
    assert refused.value.reason == "unknown-device" and gv.SERIAL in refused.value.fix
    assert time.monotonic() - start < 30  # alone it takes 1.0 s


def test_pictures_that_lost_packets_are_left_out_and_counted(gv):
    gv.stop()
    gv._options = ("-r", "8")  # of a thousand packets; a picture here has 48
    gv.start()
    try:
        with closing(opened("aravis://127.0.0.1?fps=50")) as camera:
            until = time.monotonic() + 30
            while camera._device.incomplete < 3 and time.monotonic() < until:
                assert tuple(camera.read().size) == (256, 256)
            assert camera._device.incomplete >= 3
    finally:
        gv.stop()
        gv._options = ()
        gv.start()


def test_the_librarys_own_camera_has_everything_as_well(fake):
    assert fake.identity() == Identity("aravis://Fake_1", "1", "Fake_1", "Aravis Fake")
    assert fake.read().pixels.shape == (512, 512, 3)
    controls = {control.name: control for control in fake.controls()}
    assert set(controls) == {"exposure", "gain", "width", "height", "frame_rate"}
    assert controls["exposure"].unit == "µs" and controls["exposure"].range == (10, 10_000_000)
    assert controls["gain"].automatic is False and controls["exposure"].automatic is None


def test_gain_goes_to_the_camera_and_back(fake):
    assert fake.set_control("gain", "auto").automatic is True
    by_hand = fake.set_control("gain", 4)
    assert by_hand.value == 4 and by_hand.automatic is False


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("width", 0, "bad-control"),
        ("width", 4096, "bad-control"),
        ("exposure", "auto", "bad-control"),
        ("exposure", float("inf"), "bad-control"),
        ("white_balance_red", 1, "unknown-control"),
    ],
)
def test_a_setting_that_is_refused_leaves_it_running(fake, name, value, reason):
    with pytest.raises(TouchlineError) as refused:
        fake.set_control(name, value)
    assert refused.value.reason == reason and refused.value.fix
    assert tuple(fake.read().size) == (512, 512)


@pytest.mark.parametrize("name", ["BayerRG8", "BayerGB8", "BayerGR8", "BayerBG8", "RGB8", "Mono8"])
def test_every_kind_of_pixels_that_it_sends_is_read(name):
    need_aravis()
    with closing(source_from_url(f"{FAKE}&pixel_format={name}", SourceContext())) as camera:
        pixels = camera.read().pixels.astype(int)
    grey = np.abs(np.diff(pixels, axis=-1)).max() == 0
    assert pixels.shape == (512, 512, 3) and pixels.std() > 20 and grey == (name == "Mono8")


@pytest.mark.parametrize(
    ("url", "kind", "reason"),
    [
        ("aravis://Fake_1?pixel_format=BGR8", BadInput, "bad-option"),
        ("aravis://Fake_7", Unavailable, "camera-off"),
        ("aravis://localhost", NotFound, "unknown-device"),
        ("aravis://1.2.3", NotFound, "unknown-device"),
    ],
)
def test_an_address_that_names_nothing_is_refused(url, kind, reason):
    need_aravis()
    with pytest.raises(kind) as refused:
        source_from_url(url, SourceContext())
    assert refused.value.reason == reason and refused.value.fix


def test_a_machine_without_the_library_is_told_what_to_install(monkeypatch):
    aravis_library.aravis.cache_clear()
    monkeypatch.setattr(aravis_library, "NAME", "libaravis-absent.so.0")
    with pytest.raises(Unavailable) as refused:
        source_from_url("aravis://GV02", SourceContext())
    assert (
        refused.value.reason == "no-aravis" and "apt install libaravis-0.8-0" in refused.value.fix
    )
    aravis_library.aravis.cache_clear()


def named(*names: str) -> list[DiscoveredCamera]:
    return [DiscoveredCamera(f"id {i}", "", name, "", "", None) for i, name in enumerate(names)]


def test_two_cameras_with_one_name_are_not_guessed_between():
    with pytest.raises(BadInput, match="2 cameras"):
        find_camera(named("1", "1", "2"), "1")
    assert find_camera(cameras := named("1", "1", "2"), "2") is cameras[2]
    assert find_camera(named("1"), "2") is None


@pytest.mark.parametrize("url", [FAKE, "aravis://127.0.0.1?fps=50"])
def test_opening_and_closing_leaves_nothing_behind(url, gv):
    opened(url).close()
    before = held()
    for _ in range(15):
        with closing(opened(url)) as camera:
            camera.read()
    after = held()
    assert all(after[what] <= before[what] for what in before), (before, after)
