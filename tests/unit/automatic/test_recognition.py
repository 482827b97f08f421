"""Field, covered area and rotation as an image shows them: right, offered, or declined, and never guessed."""

import hashlib
from dataclasses import replace

import cv2
import numpy as np
import pytest

from tests.support import second_simulator
from tests.support.auto_scenes import (
    SceneSpec,
    SeenScene,
    carpet_error_mm,
    error_mm,
    fields,
    scene_of,
)
from tests.support.tiers import rounds
from touchline.automatic.recognition import AUTO, RecognitionRequest, request_for, run_auto
from touchline.automatic.request import AutomaticRequest
from touchline.core.errors import BadInput, FitFailed, NotFound
from touchline.core.field import Line
from touchline.core.records import Frame
from touchline.models import field_from_raw, model_from_json

FULL = SceneSpec(
    3, "ssl-div-b", "full", "mild", (816, 682), 5500.0, 12.0, 0.0, 3.0, 0.7, 2.0, 0.1, 6, 0
)
HALF = replace(FULL, field="ssl-2008", region="half", lens="half", roll_deg=-17.0)
ENDS = {("half-right", 90), ("half-left", 270)}


def asked(pixels, names=None, **more):
    known = fields() if names is None else {name: fields()[name] for name in names}
    return RecognitionRequest(tuple(known.values()), **more).answer(Frame(pixels))


def choices_of(told):
    return {(choice["region"], choice["rotate"]) for choice in told["recognised"]["choices"]}


@pytest.fixture(scope="module")
def full() -> SeenScene:
    return scene_of(FULL)


@pytest.fixture(scope="module")
def half() -> SeenScene:
    return scene_of(HALF)


@pytest.fixture(scope="module")
def half_told(half):
    return asked(half.pixels)


def test_a_whole_field_is_recognised_among_all_and_calibrated(full):
    told, made = asked(full.pixels)
    assert (told["field"], told["region"], told["rotate"]) == ("ssl-div-b", "full", 0)
    assert made is not None and error_mm(made, full) < 3.0 and not told["doubts"]
    runner_up = told["recognised"]["runner_up"]
    assert runner_up["field"] != "ssl-div-b" and 0 < runner_up["share"] < 0.85
    assert told["recognised"]["value"] > 0.9


def test_of_a_half_both_ends_are_offered_and_neither_is_guessed(half_told):
    told, made = half_told
    assert (
        made is None
        and told["observations"] == []
        and told["verdict"]["reason"] == "several-choices"
    )
    assert {choice["field"] for choice in told["recognised"]["choices"]} == {"ssl-2008"}
    assert choices_of(told) == ENDS and told["field"] == "ssl-2008" and told["region"] is None


@pytest.mark.parametrize(
    "given",
    [{"region": "half"}, {"rotate": 90}, {"given": {"rough": {"turn_deg": -107.0}}}],
    ids=["region", "rotate", "turn"],
)
def test_what_is_known_decides_between_them(half, given):
    told, made = asked(half.pixels, ("ssl-2008", "ssl-div-b"), **given)
    assert made is not None and error_mm(made, half) < 3.0 and told["field"] == "ssl-2008"
    assert (told["region"], told["rotate"]) in {("half", 90), ("half-right", 90)}


@rounds("end", *sorted(ENDS))
def test_each_of_the_choices_is_calibrated_when_it_is_asked_for(half, end):
    field = fields()["ssl-2008"]
    told, made = AutomaticRequest(field, field.region(*end)).answer(Frame(half.pixels))
    assert made is not None and told["areas"] == []
    model = model_from_json(made.model_name, made.model_parameters)
    turn = 1 if end[0] == "half-right" else -1
    assert carpet_error_mm(lambda raw: turn * field_from_raw(model, raw), half)[0] < 3.0


def test_a_wall_beside_the_lines_is_not_the_border():
    # a table with white walls, a cable and shade
    scene = second_simulator.render(second_simulator.scene_spec(3))
    told, made = asked(scene.pixels, ("table", "ssl-2008"))
    assert told["field"] == "table" and made is not None
    corners = np.array([(x, y, 0.0) for x in scene.region.x_mm for y in scene.region.y_mm])
    raw = scene.camera.project(corners)
    model = model_from_json(made.model_name, made.model_parameters)
    off = np.linalg.norm(field_from_raw(model, raw) - corners[:, :2], axis=1)
    # mm; the wall stands 100 mm outside, and the lines are painted some millimetres off
    assert off.max() < 30.0


def drawn(*shapes, size=(640, 480)):
    picture = np.full((size[1], size[0]), 60, np.uint8)
    for shape in shapes:
        cv2.polylines(
            picture, [np.round(np.array(shape) * 16).astype(np.int32)], True, 240, 3, cv2.LINE_AA, 4
        )
    return cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR)


def rectangle(width, height, turn_deg=2.0):
    turn = np.radians(turn_deg)
    corners = np.array([(-width, -height), (width, -height), (width, height), (-width, height)]) / 2
    return corners @ np.array([(np.cos(turn), np.sin(turn)), (-np.sin(turn), np.cos(turn))]) + (
        320,
        240,
    )


@rounds("size", (449, 400), (500, 400), (540, 300))
def test_a_rectangle_is_no_field(size):
    told, made = asked(drawn(rectangle(*size)))
    assert made is None and told["recognised"]["choices"] == []
    assert told["verdict"]["level"] == "nothing" and told["verdict"]["fix"] and told["lines"]


def test_a_picture_without_lines_says_so():
    told, made = asked(np.full((480, 640, 3), 90, np.uint8))
    assert (
        made is None
        and told["doubts"][0]["reason"] == "no-lines"
        and told["recognised"]["value"] is None
    )
    assert told["field"] is None and told["recognised"]["runner_up"] is None


def test_real_boards_without_lines_are_not_offered_as_a_table(real_data):
    # the top of its wall is a rectangle
    picture = cv2.imread(str(real_data("fields/agh_mirosot/img/a_1.jpg")))
    told, made = asked(picture)
    assert (
        made is None
        and told["recognised"]["choices"] == []
        and told["doubts"][0]["reason"] == "no-known-field"
    )


def test_the_real_half_field_of_2008_is_offered_from_both_ends(real_data):
    told, _ = asked(cv2.imread(str(real_data("fields/ssl_2008/ssl-field-2008.jpg"))))
    assert (
        choices_of(told) == ENDS
        and told["field"] == "ssl-2008"
        and told["recognised"]["value"] > 0.9
    )


def test_a_field_that_is_not_alike_from_both_ends_tells_which_end_is_seen(full):
    field = fields()["ssl-div-b"]
    mark = {"mark": Line("mark", (2000.0, -2000.0), (2000.0, 2000.0), 10.0)}
    own = replace(field, name="own", lines={**field.lines, **mark})
    scene = scene_of(replace(FULL, region="half-right", robots=0))
    pixels = scene.pixels.copy()
    ends = scene.camera.raw_from_field(mark["mark"].sample(60))
    cv2.polylines(
        pixels, [np.round(ends * 16).astype(np.int32)], False, (240, 240, 240), 2, cv2.LINE_AA, 4
    )
    told, made = RecognitionRequest((own, fields()["table"])).answer(Frame(pixels))
    assert told["field"] == "own" and choices_of(told) == {("half-right", 0)} and made is not None


LINE_8 = {"thin": 0.0, "thin and sharpened": 1.5}


@rounds("how", *LINE_8)
def test_lines_of_one_pixel_without_soft_edges_are_found(how):
    field = fields()["vsss-3v3"]
    turn = np.radians(1.0)
    about = np.array([(np.cos(turn), np.sin(turn)), (np.sin(turn), -np.cos(turn))])
    picture = np.full((480, 640), 35, np.uint8)
    for marking in field.markings:
        raw = 0.262 * marking.sample(200) @ about + (319.5, 239.5)
        cv2.polylines(picture, [np.round(raw).astype(np.int32)], False, 250, 1, cv2.LINE_8)
    if sharper := LINE_8[how]:
        picture = cv2.addWeighted(
            picture, 1 + sharper, cv2.GaussianBlur(picture, (0, 0), 1.5), -sharper, 0
        )
    noisy = np.clip(picture + np.random.default_rng(0).normal(0, 3, picture.shape), 0, 255).astype(
        np.uint8
    )
    told, made = AutomaticRequest(field, field.region("full")).answer(
        Frame(cv2.cvtColor(noisy, cv2.COLOR_GRAY2BGR))
    )
    assert made is not None and told["proof"]["found_share"] > 0.9 and told["proof"]["rms_px"] < 0.5


def test_the_request_is_the_known_one_where_both_are_given_and_comes_back_from_json():
    known = fields()
    assert isinstance(request_for(known, "table", "full", None), AutomaticRequest)
    request = request_for(known, AUTO, "half-left", 90, model="division", note="so")
    again = RecognitionRequest.from_json(request.to_json())
    assert [field.name for field in again.fields] == list(
        known
    ) and again.to_json() == request.to_json()
    only = request_for(known, "table", AUTO, None)
    assert [field.name for field in only.fields] == ["table"]


@pytest.mark.parametrize(
    ("field", "region", "more", "error"),
    [
        (AUTO, "nowhere", {}, NotFound),
        ("table", AUTO, {"model": "magic"}, NotFound),
        (AUTO, AUTO, {"rough": {"height_mm": 0}}, BadInput),
    ],
)
def test_what_cannot_be_meant_is_refused_before_an_image_is_read(field, region, more, error):
    with pytest.raises(error) as refused:
        request_for(fields(), field, region, None, **more)
    assert refused.value.fix


def test_a_field_without_markings_does_not_compete_and_alone_says_what_it_lacks(full):
    bare = replace(fields()["table"], name="bare", lines={}, arcs={})
    request = RecognitionRequest((bare, fields()["vsss-3v3"]))
    assert request.answer(Frame(np.full((200, 300, 3), 90, np.uint8)))[1] is None
    with pytest.raises(FitFailed) as refusal:
        RecognitionRequest((bare,)).answer(Frame(full.pixels))
    assert refusal.value.reason == "no-markings"


def test_the_job_takes_both_kinds_of_request(half, tmp_path):
    cv2.imwrite(str(tmp_path / "half.png"), half.pixels)
    pictures = [
        {
            "name": "half",
            "path": str(tmp_path / "half.png"),
            "sha256": hashlib.sha256((tmp_path / "half.png").read_bytes()).hexdigest(),
        }
    ]
    for request in (
        request_for(fields(), "ssl-2008", AUTO, None),
        request_for(fields(), "ssl-2008", "half", None),
    ):
        done = run_auto(
            {"task": request.to_json(), "pictures": pictures, "keep": True},
            lambda share, words: None,
        )
        assert (done["made"] is None) == ("recognised" in done["told"]) and done["told"][
            "field"
        ] == "ssl-2008"


def test_cancelling_stops_between_two_fields(full):
    class Stop(Exception):
        pass

    heard = []

    def stop(fraction, message):
        heard.append(fraction)
        if fraction > 0.15:
            raise Stop

    with pytest.raises(Stop):
        RecognitionRequest(tuple(fields().values())).answer(Frame(full.pixels), stop)
    assert heard == sorted(heard)
