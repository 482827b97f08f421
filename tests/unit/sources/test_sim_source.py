"""The simulated camera can be set like a real one, its light changes, and its pictures can tell the time."""

import gc
import time
import tracemalloc

import cv2
import numpy as np
import pytest

from tests.support.sim_truth import truth_at
from tests.support.timecode_reader import read_timecode
from touchline.core.errors import BadInput, NotFound
from touchline.sources import SourceContext, source_from_url
from touchline.sources.sim import timecode
from touchline.sources.sim.camera import LENSES, BrownConrady, Division, Ssl
from touchline.sources.sim.ground import DRIFT_PERIOD_S, Lamps
from touchline.store.fields import load_fields

FIELDS = load_fields()
QUIET = "sim://ssl-div-b?size=640x480&fps=240&noise=0&robots=0"


def sim(url: str = QUIET):
    return source_from_url(url, SourceContext(FIELDS))


def middle(source) -> np.ndarray:
    """Mean blue, green, red of the picture's middle."""
    return source.read().pixels[150:330, 200:440].reshape(-1, 3).mean(axis=0)


def test_exposure_and_gain_make_the_picture_as_much_brighter():
    source = sim()
    usual = middle(source)
    assert source.set_control("exposure", 2000).value == 2000
    np.testing.assert_allclose(middle(source), usual / 2, atol=0.6)
    assert source.set_control("gain", 6.0206).value == 6.0206
    np.testing.assert_allclose(middle(source), usual, atol=0.6)


def test_gain_amplifies_the_noise_and_exposure_does_not():
    def noise(source) -> float:
        a, b = (source.read().pixels[150:330, 200:440].astype(float) for _ in range(2))
        return float((a - b).std() / np.sqrt(2))

    source = sim(QUIET.replace("noise=0", "noise=3&light=0.5"))
    usual = noise(source)
    source.set_control("exposure", 2000)
    assert noise(source) == pytest.approx(usual, rel=0.1)
    source.set_control("gain", 6.0206)
    assert noise(source) == pytest.approx(2 * usual, rel=0.1)


def test_a_higher_white_balance_is_warmer():
    source = sim()
    blue, green, red = middle(source)
    source.set_control("white_balance", 8000.0)
    warm = middle(source)
    assert (
        warm[0] < 0.85 * blue and warm[1] == pytest.approx(green, abs=0.5) and warm[2] > 1.2 * red
    )


def test_an_automatic_exposure_follows_the_light():
    source = sim(QUIET.replace("fps=240", "fps=30") + "&light=0.4")
    dark = source.read().pixels.mean()
    assert source.set_control("exposure", "auto").automatic is True
    assert dark < 40 and source.read().pixels.mean() == pytest.approx(110, abs=12)
    exposure = source.controls()[0]
    assert exposure.value > 4000 and exposure.automatic
    assert source.set_control("exposure", 4000).automatic is False
    assert source.read().pixels.mean() == pytest.approx(dark, abs=0.5)


def test_no_exposure_is_longer_than_a_frame():
    source = sim()
    source.set_control("frame_rate", 10.0)
    source.set_control("exposure", 100_000)
    source.set_control("frame_rate", 100.0)
    assert {c.name: c.value for c in source.controls()}["exposure"] == 10_000
    with pytest.raises(BadInput, match="Exposure"):
        source.set_control("exposure", 10_001)


def test_another_resolution_shows_the_same_view_and_the_truth_with_it():
    source = sim(QUIET.replace("robots=0", "robots=6"))
    full = source.read().pixels
    assert source.set_control("resolution", "320x240").choices == ("640x480", "320x240", "160x120")
    half, truth = source.read().pixels, truth_at(source.rendering, source.time_s)
    assert half.shape == (240, 320, 3) and truth.hidden.shape == (240, 320)
    same_time = sim(QUIET.replace("robots=0", "robots=6")).rendering.binned(2).frame_at(0, 0.0)
    by_hand = cv2.resize(full, (320, 240), interpolation=cv2.INTER_AREA)
    away = np.abs(same_time.astype(int) - by_hand)
    # robots are drawn anew, not shrunk
    assert np.median(away) <= 1 and np.quantile(away, 0.999) < 30
    marks = np.array([line.sample(5)[2] for line in FIELDS["ssl-div-b"].lines.values()])
    camera = source.camera
    np.testing.assert_allclose(
        2 * camera.raw_from_field(marks) + 0.5, sim().camera.raw_from_field(marks), atol=1e-9
    )
    source.set_control("resolution", "640x480")
    assert source.read().pixels.shape == (480, 640, 3)


def test_the_frame_rate_can_be_changed_without_a_jump_in_time():
    source = sim()
    for _ in range(3):
        source.read()
    assert source.time_s == pytest.approx(2 / 240)
    source.set_control("frame_rate", 120.0)
    source.read()
    assert source.time_s == pytest.approx(2 / 240 + 1 / 120)


def test_time_goes_by_while_no_picture_is_made():
    source = sim()
    source.read()
    source.pass_over(0.5)
    source.read()
    assert source.time_s == pytest.approx(0.5)
    source.pass_over(0.001)  # less than from frame to frame
    source.read()
    assert source.time_s == pytest.approx(0.5 + 1 / 240)


def test_what_a_camera_keeps_is_little():
    """Where its pixels look, two planes; their blur and light; the still picture in 16 bits; a picture: 25 bytes."""

    def open_and_read():
        source = sim(QUIET.replace("noise=0", "noise=2"))
        return source, source.read()

    open_and_read()  # what all cameras share
    gc.collect()
    tracemalloc.start()
    try:
        source, frame = open_and_read()
        gc.collect()
        kept, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert kept < 28 * frame.size.width * frame.size.height
    assert source.rendering.camera.image_size == frame.size


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("exposure", float("nan")),
        ("exposure", 0),
        ("exposure", "bright"),
        ("exposure", True),
        ("gain", "auto"),
        ("gain", -1),
        ("white_balance", 1e9),
        ("resolution", "1x1"),
        ("resolution", 3),
        ("frame_rate", 0),
        ("frame_rate", None),
        ("frame_rate", []),
    ],
)
def test_a_setting_that_cannot_be_is_refused_with_what_can(name, value):
    source = sim()
    before = source.controls()
    with pytest.raises(BadInput) as refused:
        source.set_control(name, value)
    assert refused.value.reason == "bad-control" and refused.value.fix.startswith("Use ")
    assert source.controls() == before


def test_an_unknown_setting_lists_the_known_ones():
    with pytest.raises(NotFound) as refused:
        sim().set_control("zoom", 2)
    assert refused.value.reason == "unknown-control" and "exposure" in refused.value.fix


def test_a_serial_number_tells_two_cameras_apart_and_a_place_does_without_one():
    one, other = (sim(f"{QUIET}&serial={s}").identity() for s in ("A1", "B2"))
    assert (
        "serial" in one.differs_from(other)
        and one.differs_from(sim(f"{QUIET}&serial=A1").identity()) is None
    )
    left, right = (sim(f"{QUIET}&cameras=2&camera={i}").identity() for i in (0, 1))
    assert left.differs_from(right) and left.differs_from(left) is None and left.serial == ""
    with pytest.raises(BadInput):
        sim(f"{QUIET}&serial={'x' * 101}")


@pytest.mark.parametrize(
    ("given", "lens"),
    [
        ("lens=ssl&a=0.2", Ssl(0.2)),
        ("lens=division&k=-0.1", Division(-0.1)),
        (
            "lens=brown-conrady&k1=-0.2&k2=0.03&p1=0.001&k4=0.01",
            BrownConrady(-0.2, 0.03, 0.001, k4=0.01),
        ),
        ("lens=strong&k3=0.01", BrownConrady(-0.28, 0.09, k3=0.01)),
        ("lens=fisheye", LENSES["fisheye"]),
    ],
)
def test_a_lens_is_a_preset_with_terms_by_name(given, lens):
    assert sim(f"{QUIET}&{given}").camera.lens == lens


def test_a_term_that_a_lens_does_not_have_is_refused_with_those_it_has():
    with pytest.raises(BadInput, match="division") as refused:
        sim(f"{QUIET}&lens=division&k1=0.1")
    assert refused.value.reason == "bad-option" and refused.value.fix == "It has k."


def test_the_light_flickers_and_drifts_as_asked():
    t = np.linspace(0, DRIFT_PERIOD_S, 100_001)
    assert np.ptp(Lamps(flicker=0.2).brightness(t, 0.0)) == pytest.approx(0.4, rel=5e-3)
    # one whole flicker
    assert np.ptp(Lamps(flicker=0.2, flicker_hz=100).brightness(t, 0.010)) < 1e-9
    drift = Lamps(drift=0.3).brightness(t, 0.004)
    assert (drift.min(), drift.max()) == (pytest.approx(0.7), pytest.approx(1.3))
    assert (Lamps().brightness(t, 0.004) == 1).all()


def test_flicker_stands_in_the_rows_of_a_rolling_shutter_and_in_none_of_a_global_one():
    still = sim().read().pixels[..., 1].mean(axis=1)
    source = sim(QUIET + "&flicker=0.3&flicker_hz=100&readout=15")
    rows = source.read().pixels[..., 1].mean(axis=1) / still
    expected = source.rendering.row_gain(0.0)
    assert np.ptp(expected) > 0.4
    np.testing.assert_allclose(rows, expected, atol=0.04)  # in strips of eight rows
    ratio = sim(QUIET + "&flicker=0.3&flicker_hz=37&readout=0")
    ratio.read()
    rows = ratio.read().pixels[..., 1].mean(axis=1) / still
    assert abs(rows.mean() - 1) > 0.05 and rows.std() < 0.02


@pytest.mark.parametrize("size", ["1920x1080", "1280x1024", "640x480", "333x250"])
def test_a_picture_tells_the_time_it_was_taken(size):
    source = sim(f"sim://ssl-div-b?size={size}&fps=200&timecode=true")
    for _ in range(3):
        before = time.time_ns() // 1_000_000
        read = read_timecode(source.read().pixels)
        assert before <= read <= time.time_ns() // 1_000_000


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("width", [480, 481, 640, 960])
def test_the_time_survives_shrinking_and_jpeg(seed, width):
    rng = np.random.default_rng(seed)
    picture = rng.integers(0, 255, (1080 // 8, 1920 // 8, 3), np.uint8)
    picture = cv2.resize(picture, (1920, 1080), interpolation=cv2.INTER_LINEAR)
    stamp = int(rng.integers(1 << 41))
    timecode.paint(picture, stamp)
    small = cv2.resize(
        picture,
        (width, width * 9 // 16),
        interpolation=[cv2.INTER_AREA, cv2.INTER_LINEAR][seed % 2],
    )
    jpeg = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, 60])[1]
    assert read_timecode(cv2.imdecode(jpeg, cv2.IMREAD_COLOR)) == stamp
    assert read_timecode(cv2.imdecode(jpeg, cv2.IMREAD_GRAYSCALE)) == stamp


def test_a_time_that_is_not_there_is_not_read():
    rng = np.random.default_rng(0)
    assert all(
        read_timecode(rng.integers(0, 255, (90, 320, 3), np.uint8)) is None for _ in range(200)
    )
    assert read_timecode(sim().read().pixels) is None
    assert read_timecode(np.zeros((8, 8, 3), np.uint8)) is None
    picture = np.zeros((270, 480, 3), np.uint8)
    timecode.paint(picture, 1_763_700_000_000)
    for cell in (0, 9, 30, 51, 55, 63):  # one cell turned round, anywhere
        broken = picture.copy()
        broken[5:10, 5 + 5 * cell : 10 + 5 * cell] = (
            255 - broken[5:10, 5 + 5 * cell : 10 + 5 * cell]
        )
        assert read_timecode(broken) is None
    with pytest.raises(ValueError, match="not a time"):
        timecode.paint(picture, 1 << 48)
