"""GenICam cameras, over the simulated producer that the genicam package brings: three cameras, real buffers."""

import gc
import os
import shutil
import signal
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from tests.support.industrial import held, missing, viky, with_viky
from tests.support.tiers import long
from touchline.core.errors import BadInput, NotFound, TouchlineError, Unavailable
from touchline.settings import Settings
from touchline.sources import Identity, SourceContext, source_from_url
from touchline.sources.industrial.genicam_producers import producers_in

RED = "genicam://VikyTL_DEV_red?producer=viky&fps=100"


@pytest.fixture
def camera():
    opened = source_from_url(RED, with_viky())
    yield opened
    opened.close()


def test_a_camera_is_found_by_serial_id_or_place_and_says_who_it_is():
    for target, serial in (("1", "1"), ("VikyTL_DEV_blue", "2"), ("0", "0")):
        camera = source_from_url(f"genicam://{target}", with_viky())
        assert camera.identity() == Identity(f"genicam://{target}", serial, camera.identity().port,
                                             "Machine Vision Games Ltd. Viky")
        camera.close()


def test_each_of_the_cameras_shows_its_own_colour():
    """A ball of the camera's colour jumps about on white: the one channel that is not darkened is its own."""
    for name, channel in (("blue", 0), ("green", 1), ("red", 2)):
        camera = source_from_url(f"genicam://VikyTL_DEV_{name}", with_viky())
        pixels = camera.read().pixels
        camera.close()
        ball = (pixels.min(axis=-1) < 100)
        assert ball.sum() > 100
        assert np.argmax(pixels[ball].mean(axis=0)) == channel


def test_frames_follow_one_another(camera):
    first, *others = (camera.read() for _ in range(10))
    assert first.pixels.shape == (400, 400, 3) and not first.pixels.flags.writeable
    assert any((other.pixels != first.pixels).any() for other in others)


def test_grey_is_sent_where_grey_is_asked_for():
    camera = source_from_url(f"{RED}&pixel_format=Mono8", with_viky())
    pixels = camera.read().pixels
    assert (pixels[..., 0] == pixels[..., 1]).all() and (pixels[..., 1] == pixels[..., 2]).all()
    camera.close()


def test_size_and_rate_are_read_back_and_the_next_frame_has_them(camera):
    controls = {control.name: control for control in camera.controls()}
    assert set(controls) == {"width", "height", "frame_rate"}
    assert controls["width"].range == (100, 800) and controls["frame_rate"].value == 100
    assert camera.set_control("width", 640).value == 640
    assert camera.set_control("height", 200).value == 200
    assert tuple(camera.read().size) == (640, 200)
    assert camera.set_control("frame_rate", 20).value == 20


@pytest.mark.parametrize(("name", "value", "reason"), [
    ("width", 99, "bad-control"), ("width", 801, "bad-control"), ("width", "auto", "bad-control"),
    ("frame_rate", float("nan"), "bad-control"), ("gain", 1, "unknown-control"), ("PayloadSize", 1, "unknown-control")])
def test_a_setting_that_is_refused_leaves_it_running(camera, name, value, reason):
    with pytest.raises(TouchlineError) as refused:
        camera.set_control(name, value)
    assert refused.value.reason == reason and refused.value.fix
    assert tuple(camera.read().size) == (400, 400)


def test_a_picture_of_which_parts_are_missing_is_left_out_and_counted(camera):
    """The producer marks none, so its pictures are cut short here where they come out of it."""
    device = camera._device
    whole, cut = device._buffer, [True, True, False]

    class Short:
        def __init__(self, buffer):
            self._buffer = buffer

        def __getattr__(self, name):
            value = getattr(self._buffer, name)
            return value[:1000] if name == "raw_buffer" else value

    device._buffer = lambda: buffer and (Short(buffer) if cut.pop(0) else buffer) if (buffer := whole()) else None
    device._requeue = lambda buffer, give=device._requeue: give(getattr(buffer, "_buffer", buffer))
    assert tuple(camera.read().size) == (400, 400)
    assert device.incomplete == 2
    camera.close()
    assert device.incomplete == 2


def test_a_camera_that_sends_nothing_any_more_is_off(camera):
    camera.read()
    camera._device.nodes.set("AcquisitionStop", None)
    with pytest.raises(Unavailable, match="no image") as refused:
        while True:  # what was under way may still come
            camera.read()
    assert refused.value.reason == "camera-silent"


def test_a_taken_producer_is_told_from_a_missing_camera(camera):
    with pytest.raises(Unavailable) as refused:
        source_from_url("genicam://1", with_viky())
    assert refused.value.reason == "camera-busy"
    camera.close()
    source_from_url("genicam://1", with_viky()).close()


@pytest.mark.parametrize(("url", "kind", "reason", "told"), [
    ("genicam://GX123", NotFound, "unknown-device", "0, 1, 2"),
    ("genicam://3", NotFound, "unknown-device", "0, 1, 2"),
    ("genicam://1?producer=pylon", NotFound, "unknown-producer", "viky"),
    ("genicam://1?producer=..%2Fviky", NotFound, "unknown-producer", "viky"),
    ("genicam://1?producer=%2Ftmp%2Fviky.cti", NotFound, "unknown-producer", "viky"),
    ("genicam://1?pixel_format=BGR8", BadInput, "bad-option", "Mono8"),
    ("genicam://1?pixel_format=Mono12", BadInput, "bad-option", "Mono8"),
    ("genicam://1?fps=230", BadInput, "bad-option", "1 to 200")])
def test_an_address_that_names_nothing_is_refused_and_lets_go(url, kind, reason, told):
    with pytest.raises(kind) as refused:
        source_from_url(url, with_viky())
    assert refused.value.reason == reason and told in refused.value.fix
    source_from_url(RED, with_viky()).close()


def test_without_a_producer_it_says_what_to_install(tmp_path):
    (tmp_path / "notes.txt").write_text("no producer")
    for places in ((), (tmp_path,), (tmp_path / "absent",)):
        with pytest.raises(Unavailable) as refused:
            source_from_url("genicam://0", SourceContext(producers=places))
        assert refused.value.reason == "no-producer" and "GENICAM_GENTL64_PATH" in refused.value.fix


def test_a_producer_that_is_no_library_has_no_cameras(tmp_path):
    viky()
    (tmp_path / "broken.cti").write_bytes(b"\x7fELF and then nothing")
    with pytest.raises(NotFound):
        source_from_url("genicam://0", SourceContext(producers=(tmp_path,)))


def test_producers_come_from_the_operator_alone(tmp_path, monkeypatch):
    monkeypatch.setenv("GENICAM_GENTL64_PATH", os.pathsep.join((str(tmp_path), "", "relative", "/absent")))
    assert Settings().sources.known_producers == (tmp_path, Path("/absent"))
    assert Settings(sources={"producers": []}).sources.known_producers == ()
    monkeypatch.delenv("GENICAM_GENTL64_PATH")
    assert Settings().sources.known_producers == ()


def test_producers_are_the_cti_files_of_a_folder_by_name(tmp_path):
    (tmp_path / "b.cti").touch()
    (tmp_path / "a.cti").touch()
    (tmp_path / "folder.cti").mkdir()
    (tmp_path / "c.txt").touch()
    os.mkfifo(tmp_path / "pipe.cti")
    assert list(producers_in((tmp_path,))) == ["a", "b"]
    assert list(producers_in((tmp_path / "b.cti", tmp_path / "c.txt"))) == ["b"]


def test_the_same_name_twice_is_the_first_ones(tmp_path):
    folder = viky()[0]
    shutil.copy(folder / "viky.cti", tmp_path)
    assert producers_in((tmp_path, folder)) == {"viky": (tmp_path / "viky.cti").resolve()}


def test_a_missing_package_is_told_with_how_to_install_it(monkeypatch):
    around = with_viky()
    monkeypatch.setitem(sys.modules, "harvesters.core", None)
    with pytest.raises(Unavailable) as refused:
        source_from_url(RED, around)
    assert refused.value.reason == "no-genicam"
    assert refused.value.fix.endswith("harvesters, then start Touchline again.")


@pytest.mark.parametrize("handler", [signal.default_int_handler, signal.SIG_IGN], ids=["handled", "ignored"])
def test_ctrl_c_stays_with_whoever_had_it(handler):
    before = signal.signal(signal.SIGINT, handler)
    try:
        source_from_url(RED, with_viky()).close()
        assert signal.getsignal(signal.SIGINT) is handler
    finally:
        signal.signal(signal.SIGINT, before)


def test_other_threads_run_while_it_waits(camera):
    """GenTL's binding holds the interpreter's lock: waiting for a slow camera must not stop the process' other work."""
    camera.set_control("frame_rate", 4)
    camera.read()
    # Of four frames some may have come already; for the others it waits a quarter of a second each.
    turns, reading = 0, threading.Thread(target=lambda: [camera.read() for _ in range(4)])
    reading.start()
    while reading.is_alive():
        time.sleep(0.001)
        turns += 1
    assert turns > 20  # of some 500 where nothing else runs; were the lock held, there would be a few


@pytest.mark.parametrize("times", [3, long(20)])
def test_opening_and_closing_leaves_nothing_behind(times):
    if not Path("/proc/self/fd").exists():
        missing("/proc", "run this on Linux")
    around = with_viky()
    source_from_url(RED, around).close()
    before = held() | {"descriptions": descriptions()}
    for _ in range(times):
        camera = source_from_url(RED, around)
        camera.read()
        camera.close()
    after = held() | {"descriptions": descriptions()}
    assert all(after[what] <= before[what] for what in before), (before, after)


def descriptions() -> int:
    """Cameras' descriptions of themselves that are still in memory, half a megabyte each."""
    from genicam.genapi import NodeMap
    gc.collect()
    return sum(isinstance(thing, NodeMap) for thing in gc.get_objects())
