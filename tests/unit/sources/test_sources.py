"""Laws over every source, and what an address must be."""

import time
from contextlib import closing

import cv2
import numpy as np
import pytest

from tests.support.peers import HOSTS, address_of, with_option
from touchline.core.errors import BadInput, NotFound, TouchlineError, Unavailable
from touchline.core.options import Option
from touchline.images.in_process import decode_in_process, read_in_process
from touchline.sources import SOURCES, Source, SourceContext, source_from_url, split_address
from touchline.store.fields import load_fields

FIELDS = load_fields()
every_source = pytest.mark.parametrize("name", list(SOURCES))


@pytest.fixture
def around(tmp_path) -> SourceContext:
    folder = tmp_path / "pictures"
    folder.mkdir()
    return SourceContext(FIELDS, decode_in_process, folder, HOSTS, read_in_process)


@pytest.fixture
def address(name, around):
    with address_of(name, around.pictures) as url:
        yield url


@pytest.fixture
def source(address, around):
    opened = source_from_url(address, around)
    yield opened
    opened.close()


@every_source
def test_a_source_follows_the_contract_and_describes_itself(name, source):
    assert isinstance(source, Source)
    assert all(
        isinstance(text, str) and text for text in (source.TITLE, source.HELP, source.TARGET)
    )
    assert len({option.name for option in source.OPTIONS}) == len(source.OPTIONS)
    for option in source.OPTIONS:
        assert isinstance(option, Option) and option.help.endswith(".")
        if option.default is not None and option.type != "text":
            assert option.read(option.default) == option.default


@every_source
def test_frames_come_one_after_the_other_and_are_alike_in_size(name, source):
    frames = [source.read() for _ in range(3)]
    for frame in frames:
        assert frame.pixels.dtype == np.uint8 and frame.pixels.shape == (
            *frames[0].pixels.shape[:2],
            3,
        )
        assert frame.pixels.flags.c_contiguous and not frame.pixels.flags.writeable


@every_source
def test_a_source_waits_for_its_next_frame(name, around):
    with address_of(name, around.pictures, fps=10) as url:
        start = time.monotonic()
        with closing(source_from_url(url, around)) as slow:
            # from the opening on: a busy machine may be late for one and then in time for the next
            for _ in range(5):
                slow.read()
            assert 0.3 < time.monotonic() - start < 20


@every_source
def test_a_closed_source_says_so_and_closes_twice(name, source):
    source.close()
    source.close()
    with pytest.raises(Unavailable) as refused:
        source.read()
    assert refused.value.reason == "source-closed"


@every_source
def test_an_unknown_option_is_named_with_the_known_ones(name, address, around):
    with pytest.raises(BadInput, match="colour") as refused:
        source_from_url(with_option(address, "colour", "red"), around)
    assert refused.value.reason == "unknown-option"
    assert all(option.name in refused.value.fix for option in SOURCES[name].OPTIONS)


@every_source
@pytest.mark.parametrize("value", ["nan", "inf", "1e999", "-1", "x", "", "0", "1e9", "١"])
def test_an_option_out_of_its_range_is_refused(name, address, around, value):
    positive = {
        option.name: option
        for option in SOURCES[name].OPTIONS
        if option.range and option.range[0] > 0
    }
    option = positive.get("fps") or next(iter(positive.values()))
    try:
        source_from_url(with_option(address, option.name, value), around).close()
    except BadInput as refused:
        assert refused.reason == "bad-option" and f"{option.range[0]:g}" in refused.fix
    else:
        assert value == "١"  # Python reads every script's digits


@every_source
def test_a_source_says_which_camera_it_is_without_a_password(name, source, address):
    identity = source.identity()
    assert identity.address.startswith(f"{name}://") and identity.differs_from(identity) is None


@every_source
def test_what_can_be_set_is_read_back_and_what_cannot_is_named(name, source):
    source.read()
    controls = source.controls()
    assert len({control.name for control in controls}) == len(controls)
    with pytest.raises(NotFound) as refused:
        source.set_control("colour", 1)
    assert refused.value.reason == "unknown-control"
    assert all(control.name in refused.value.fix for control in controls)


@pytest.mark.parametrize(
    "url",
    [
        "",
        "sim",
        "sim:table",
        "sim://",
        "://table",
        "sim://table?seed",
        "sim://table?seed=1&seed=1",
        "sim://table#x",
        "sim://table?seed=%ff",
        "sim://[table",
        "sim://a\nb",
        "sim://" + "a" * 2000,
        None,
        7,
        "sim://\ud800",
        "sim://table?" + "&".join(f"a{i}=1" for i in range(60)),
    ],
    ids=lambda url: repr(url)[:30],
)
def test_what_is_no_address_is_refused_with_the_form(url, around):
    with pytest.raises(BadInput, match="address") as refused:
        source_from_url(url, around)
    assert refused.value.reason == "bad-source" and "sim://" in refused.value.fix


def test_an_address_is_scheme_target_and_options():
    assert split_address("sim://ssl-div-b?camera=0&lens=strong") == (
        "sim",
        "ssl-div-b",
        {"camera": "0", "lens": "strong"},
    )
    assert split_address("picture://a%20folder/b.png") == ("picture", "a folder/b.png", {})


def test_an_unknown_scheme_lists_the_known_ones(around):
    with pytest.raises(NotFound, match="webcam") as refused:
        source_from_url("webcam://0", around)
    assert (
        all(name in refused.value.fix for name in SOURCES)
        and refused.value.reason == "unknown-source"
    )


def test_a_picture_is_shown_as_it_is(around):
    pixels = np.random.default_rng(0).integers(0, 255, (40, 50, 3), dtype=np.uint8)
    (around.pictures / "one two.png").write_bytes(cv2.imencode(".png", pixels)[1].tobytes())
    frame = source_from_url("picture://one%20two.png", around).read()
    assert (frame.pixels == pixels).all() and len(frame.sha256) == 64


@pytest.mark.parametrize(
    "name",
    [
        "../secret.png",
        "/etc/passwd",
        "..%2fsecret.png",
        "link.png",
        "folder",
        "a%00.png",
        "absent.png",
        "loop.png",
        "x" * 1500,
        "./../pictures/../secret.png",
    ],
)
def test_only_pictures_in_the_folder_are_read(name, around):
    secret = around.pictures.parent / "secret.png"
    secret.write_bytes(cv2.imencode(".png", np.zeros((8, 8, 3), np.uint8))[1].tobytes())
    (around.pictures / "link.png").symlink_to(secret)
    (around.pictures / "loop.png").symlink_to(around.pictures / "loop.png")
    (around.pictures / "folder").mkdir()
    with pytest.raises(TouchlineError) as refused:
        source_from_url(f"picture://{name}", around)
    assert refused.value.reason in ("unknown-picture", "bad-source")


def test_a_broken_picture_is_refused_by_the_decoder(around):
    (around.pictures / "broken.png").write_bytes(b"\x89PNG\r\n\x1a\n and then nothing")
    with pytest.raises(BadInput):
        source_from_url("picture://broken.png", around)


def test_without_a_folder_there_are_no_pictures():
    with pytest.raises(Unavailable):
        source_from_url("picture://a.png", SourceContext(FIELDS))


@pytest.mark.parametrize(
    ("url", "reason"),
    [
        ("sim://moon", "unknown-field"),
        ("sim://table?camera=1", "bad-option"),
        ("sim://table?camera=2&cameras=2", "bad-option"),
        ("sim://table?region=attic", "unknown-region"),
        ("sim://table?lens=eye", "bad-option"),
        ("sim://table?size=1x1", "bad-option"),
        ("sim://table?size=99999x99999", "bad-option"),
        ("sim://table?size=٦٤٠x٤٨٠", "bad-option"),
        ("sim://table?height=200&tilt=60", "bad-camera"),
        ("sim://table?cameras=3", "bad-option"),
        ("sim://table?robots=2.5", "bad-option"),
    ],
)
def test_a_simulated_camera_that_cannot_be_is_refused(url, reason, around):
    with pytest.raises(TouchlineError) as refused:
        source_from_url(url, around)
    assert refused.value.reason == reason and refused.value.fix


@pytest.mark.parametrize("field", FIELDS)
@pytest.mark.parametrize(
    "part",
    ["cameras=1", "cameras=2&camera=1", "cameras=4&camera=3", "cameras=8&camera=7", "region=half"],
)
def test_every_camera_above_every_field_can_be_simulated(field, part, around):
    camera = source_from_url(f"sim://{field}?{part}&size=64x48", around)
    assert tuple(camera.read().size) == (64, 48)


def test_the_numbered_cameras_see_the_leagues_regions(around):
    names = [
        source_from_url(
            f"sim://table?cameras=4&camera={i}&size=64x48", around
        ).rendering.region.name
        for i in range(4)
    ]
    assert names == [
        "quarter-bottom-left",
        "quarter-top-left",
        "quarter-bottom-right",
        "quarter-top-right",
    ]


def test_an_address_of_an_earlier_versions_kind_says_what_took_its_place(around):
    with pytest.raises(NotFound, match="GenTL") as refused:
        source_from_url("genicam://4711?producer=mvGenTLProducer", around)
    assert (
        "aravis:// and its serial number" in refused.value.fix
        and refused.value.reason == "genicam-removed"
    )
