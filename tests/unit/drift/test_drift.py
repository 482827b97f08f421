"""Whether a camera still stands as it did: knocks are found, and nothing else is called one."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from tests.support.drifting_cameras import bumped, fitted, followed, knocked, moved_by
from tests.support.live_cameras import FIELDS
from tests.support.paths import CLICKS, SHARED_DATA
from tests.support.tiers import long, rounds
from touchline.core.geometry import ImageSize
from touchline.core.records import observations_from_json
from touchline.drift.alarm import ALARMS, DriftWatch, sentence, state_of
from touchline.evaluate.field_lines.motion import LineReference, MotionSample
from touchline.fitting.image_motion import MotionField, MotionSize, estimate_motion
from touchline.models import field_from_raw
from touchline.sources import SourceContext, source_from_url
from touchline.sources.sim.render import Rendering
from touchline.workflows.calibration_request import CalibrationRequest

HALF = "sim://ssl-div-b?cameras=2&camera=0&size=640x480&robots=6&k1=-0.25&tilt=10"
WHOLE = "sim://ssl-div-b?size=640x480&robots=8&people=1"


@pytest.fixture(scope="module")
def half():
    return followed(HALF)


@pytest.fixture(scope="module")
def half_model():
    return fitted(HALF)[1]


@pytest.fixture(scope="module")
def whole():
    return followed(WHOLE)


def looks(reference: LineReference, rendering: Rendering, seconds, watch: DriftWatch | None = None):
    """The states that a watch tells, look by look."""
    watch, sample = watch or DriftWatch(0.0), None
    for second in seconds:
        sample = reference.look(rendering.frame_at(second, float(second)), sample)
        yield watch.add(sample, float(second)), sample


@pytest.mark.parametrize(
    ("scene", "by"),
    [("half", "1 px"), ("whole", "3 mm"), long("half", "3 mm"), long("whole", "1 px")],
)
def test_a_small_knock_is_found_at_the_second_look(request, scene, by):
    rendering, reference = request.getfixturevalue(scene)
    other, (px, mm) = knocked(rendering, by, np.random.default_rng(3))
    watch = DriftWatch(0.0)
    assert [told.state for told, _ in looks(reference, rendering, range(1, 4), watch)] == [
        "steady"
    ] * 3
    told = [told for told, _ in looks(reference, other, range(4, 6), watch)]
    assert [one.state for one in told] == ["steady", "knocked"]
    assert told[-1].since == 4.0  # when it was seen first
    found = told[-1].sample.moved
    # The calibration's own errors are in it too: of eight knocks the worst is 0.03 px and 0.4 mm beside the truth.
    assert found.px == pytest.approx(px, rel=0.12, abs=0.03)
    assert found.mm == pytest.approx(mm, rel=0.12, abs=0.5)
    assert told[-1].to_json()["alarm"] is True


def test_each_place_is_shown_where_it_moved_to(half):
    rendering, reference = half
    other = bumped(rendering, 0.0, -0.3, 0.2)
    sample = reference.look(other.frame_at(1, 1.0))
    field = rendering.camera.field_from_raw(sample.places)
    shifts = other.camera.raw_from_field(field) - sample.places
    assert len(sample.places) == sample.seen > 20
    assert np.linalg.norm(shifts, axis=1).min() > 1
    assert np.percentile(np.linalg.norm(sample.shifts - shifts, axis=1), 95) < 0.25
    mm = np.linalg.norm(
        rendering.camera.field_from_raw(sample.places + sample.shifts) - field, axis=1
    )
    assert reference.displacements_mm(sample) == pytest.approx(mm, rel=0.15)
    still = reference.look(rendering.frame_at(1, 1.0))
    assert np.median(np.linalg.norm(still.shifts, axis=1)) < 0.1


@pytest.mark.parametrize("degrees", [(0.6, 0, 0), (0, -0.5, 0.4), (0, 0, 2.0)])
def test_a_hard_knock_is_told_in_millimetres_as_well(half, degrees):
    rendering, reference = half
    other = bumped(rendering, *degrees)
    px, mm = moved_by(rendering, other)
    sample = reference.look(other.frame_at(1, 1.0))
    assert state_of(sample) == "knocked" and px > 4
    assert sample.moved.px == pytest.approx(px, rel=0.12)
    assert sample.moved.mm == pytest.approx(mm, rel=0.12)


@rounds("px", 8, 2, 4, 16, 20)
def test_a_picture_that_jumps_any_way_is_told_with_its_size(half, px):
    """Along many lines as well: these lie where they lay, and must not outvote the few that show the motion."""
    rendering, reference = half
    model, there = reference.samples.flow.model, reference.samples
    for degrees in range(0, 360, 30):
        shift = px * np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
        jumped = cv2.warpAffine(
            rendering.frame_at(7, 7.0),
            np.float64([[1, 0, shift[0]], [0, 1, shift[1]]]),
            tuple(reference.size),
            flags=cv2.INTER_CUBIC,
        )
        truth = np.linalg.norm(field_from_raw(model, there.raw + shift) - there.field, axis=1)
        told = reference.look(jumped)
        assert told.moved.mm == pytest.approx(np.nanpercentile(truth, 95), rel=0.25), degrees


@pytest.mark.parametrize("model", ["homography", "polynomial"])
def test_a_model_without_rays_is_followed_as_well(model):
    rendering, reference = followed("sim://ssl-div-b?size=640x480&robots=4", model)
    other, (px, mm) = knocked(rendering, "2 px", np.random.default_rng(5))
    assert state_of(reference.look(rendering.frame_at(1, 1.0))) == "steady"
    found = reference.look(other.frame_at(1, 1.0)).moved
    assert found.px == pytest.approx(px, rel=0.25) and found.mm == pytest.approx(mm, rel=0.25)


@rounds("last", 5, 15)
@pytest.mark.parametrize(
    "scene",
    [
        HALF + "&flicker=0.15&people=1",
        "sim://vsss-3v3?size=480x360&robots=6&people=1&glare=0.6&drift=0.6&noise=4",
    ],
)
def test_robots_people_and_light_are_no_knock(scene, last):
    rendering, reference = followed(scene)
    told = list(looks(reference, rendering, range(1, last + 1)))
    assert {one.state for one, _ in told} == {"steady"}
    assert max(sample.moved.px for _, sample in told) < 0.1  # px: a fifth of a knock


def test_what_a_model_does_not_tell_exactly_is_no_drift(half, half_model):
    rendering, _ = half
    x, y, z = half_model.position_mm
    wrong = replace(half_model, position_mm=(x + 40, y, z))  # some px
    reference = LineReference.of(
        [rendering.frame_at(0, 0.0)], wrong, rendering.field, rendering.region
    )
    assert reference.look(rendering.frame_at(1, 1.0)).moved.px < 0.05


@pytest.mark.parametrize(("blur_px", "how"), [(1.9, "softer"), (3.0, "softer")])
def test_a_lens_bumped_out_of_focus_is_told_from_a_knock(half, blur_px, how):
    rendering, reference = half
    soft = Rendering.of(
        rendering.camera,
        rendering.field,
        rendering.region,
        rendering.motion,
        sensor=replace(rendering.sensor, blur_px=blur_px),
    )
    told, sample = list(looks(reference, soft, range(1, 4)))[-1]
    assert told.state == "out-of-focus" and how in sentence(told.state, sample)
    assert sample.softer_px == pytest.approx(np.sqrt(blur_px**2 - 0.65**2), rel=0.35)


def test_a_lens_that_was_soft_and_is_sharp_has_another_focus_too(half, half_model):
    rendering, _ = half
    soft = Rendering.of(
        rendering.camera,
        rendering.field,
        rendering.region,
        rendering.motion,
        sensor=replace(rendering.sensor, blur_px=2.4),
    )
    reference = LineReference.of(
        [soft.frame_at(0, 0.0)], half_model, rendering.field, rendering.region
    )
    told, sample = list(looks(reference, rendering, range(1, 4)))[-1]
    assert told.state == "out-of-focus" and "sharper" in sentence(told.state, sample)


def test_a_picture_of_something_else_is_a_replaced_camera(half):
    rendering, reference = half
    other = source_from_url("sim://vsss-3v3?size=640x480&robots=3", SourceContext(FIELDS)).rendering
    assert [told.state for told, _ in looks(reference, other, range(1, 5))][-2:] == [
        "learning",
        "replaced",
    ]
    far = bumped(rendering, 9.0, 5.0)
    assert [told.state for told, _ in looks(reference, far, range(1, 5))][-2:] == [
        "learning",
        "replaced",
    ]


def test_people_who_cover_most_lines_are_no_alarm(half):
    rendering, reference = half
    for second in (1, 2):
        picture = rendering.frame_at(second, float(second))
        rng = np.random.default_rng(second)
        for _ in range(60):
            x, y = rng.integers(0, 640), rng.integers(0, 480)
            cv2.circle(
                picture, (int(x), int(y)), 45, tuple(int(v) for v in rng.integers(60, 200, 3)), -1
            )
        assert state_of(reference.look(picture)) not in ALARMS


def test_lamps_that_are_switched_off_are_no_alarm(half):
    rendering, reference = half
    dim = cv2.convertScaleAbs(rendering.frame_at(1, 1.0), alpha=0.35)
    assert state_of(reference.look(dim)) == "steady"
    dark = cv2.convertScaleAbs(rendering.frame_at(1, 1.0), alpha=0.02)
    assert state_of(reference.look(dark)) == "dark"


def test_a_real_picture_compressed_anew_is_steady_and_a_turned_one_is_not():
    path = SHARED_DATA / "fields" / "ssl_2008" / "ssl-field-2008.jpg"
    if not path.exists():
        pytest.skip("the picture is not beside the project")
    clicks, picture = json.loads((CLICKS / "ssl_2008_half.json").read_text()), cv2.imread(str(path))
    region = FIELDS[clicks["field"]].region(clicks["region"], clicks.get("rotate"))
    task = CalibrationRequest(
        observations_from_json(clicks["observations"]),
        FIELDS[clicks["field"]],
        region,
        ImageSize.of(clicks["image_size"]),
        "brown-conrady",
    )
    reference = LineReference.of(
        [picture], task.run(cross_validate=False).model, task.field, region
    )
    rng = np.random.default_rng(4)

    def sent(pixels):
        noisy = np.clip(pixels + rng.normal(0, 3, pixels.shape), 0, 255).astype(np.uint8)
        return cv2.imdecode(
            cv2.imencode(".jpg", noisy, [cv2.IMWRITE_JPEG_QUALITY, 70])[1], cv2.IMREAD_COLOR
        )

    assert all(reference.look(sent(picture)).moved.px < 0.05 for _ in range(3))
    turn = cv2.getRotationMatrix2D(task.image_size.centre, 0.2, 1)
    turned = cv2.warpAffine(picture, turn, tuple(task.image_size), flags=cv2.INTER_CUBIC)
    found = reference.look(sent(turned))
    assert state_of(found) == "knocked"
    assert found.moved.px == pytest.approx(1.25, abs=0.15)  # 0.2° at 360 px from the middle


def test_a_picture_without_lines_gives_nothing_to_follow(half, half_model):
    rendering, _ = half
    blank = np.full((480, 640, 3), 90, np.uint8)
    assert LineReference.of([blank], half_model, rendering.field, rendering.region) is None


def seen(px: float = 0.0, **more) -> MotionSample:
    return MotionSample("seen", 90, MotionSize(px, 5 * px, 0.01, 0.05), None, 100 * px, **more)


def test_one_strange_look_is_no_alarm_and_two_are():
    watch = DriftWatch(0.0)
    states = [
        watch.add(sample, float(i)).state
        for i, sample in enumerate(
            [
                seen(),
                seen(3),
                seen(),
                MotionSample("gone", 0),
                seen(),
                seen(3),
                seen(3),
                seen(),
                seen(),
            ]
        )
    ]
    assert states == [
        "steady",
        "steady",
        "steady",
        "steady",
        "steady",
        "steady",
        "knocked",
        "knocked",
        "steady",
    ]


def test_a_calibration_whose_lines_are_elsewhere_is_an_alarm_though_the_camera_stays_and_a_knock_comes_first():
    watch = DriftWatch(0.0)
    watch.misplaced("The lines lie elsewhere.")
    told = watch.add(seen(), 1.0)
    assert told.state == "misplaced" and told.alarm
    assert told.to_json()["sentence"] == "The lines lie elsewhere." and told.to_json()["fix"]
    watch.add(seen(3.0), 2.0)
    assert watch.add(seen(3.0), 3.0).state == "knocked"
    watch.add(seen(), 4.0)
    assert watch.add(seen(), 5.0).state == "misplaced"


@pytest.mark.parametrize("kind", ["dark", "covered"])
def test_an_alarm_holds_until_a_look_disproves_it_and_says_that_nothing_is_seen_now(kind):
    watch, hidden = DriftWatch(0.0), MotionSample(kind, 0)
    for second, sample in enumerate([seen(), seen(3), seen(3), *[hidden] * 6]):
        told = watch.add(sample, float(second))
    assert told.state == "knocked" and told.since == 1.0 and not watch.doubtful
    json = told.to_json()
    assert json["alarm"] and not json["monitored"] and "15 mm" in json["sentence"]
    assert "cannot be detected" in json["sentence"]
    json = watch.add(seen(3), 10.0).to_json()
    assert json["alarm"] and json["monitored"] and "cannot be detected" not in json["sentence"]
    watch.add(seen(), 11.0)
    assert not watch.add(seen(), 12.0).alarm


def test_a_camera_thought_replaced_is_believed_once_its_scene_is_seen_again_though_people_stand_in_it():
    watch = DriftWatch(0.0)
    states = [
        watch.add(sample, 0.0).state
        for sample in [MotionSample("gone", 0)] * 4
        + [MotionSample("dark", 0)] * 4
        + [MotionSample("covered", 0)] * 4
    ]
    assert states[3] == states[7] == "replaced" and states[-1] == "covered"


@pytest.mark.parametrize(
    ("kind", "monitored"), [("seen", True), ("dark", False), ("covered", False)]
)
def test_what_cannot_be_seen_is_not_monitored(kind, monitored):
    watch = DriftWatch(0.0)
    assert not watch.status.to_json()["monitored"]
    for second in range(5):
        told = watch.add(MotionSample(kind, 9, MotionSize(0, 0, 0, 0)), float(second))
    assert told.to_json()["monitored"] is monitored
    assert not watch.unfollowed(9.0).to_json()["monitored"]


def test_alarms_of_two_kinds_in_a_row_are_one():
    watch = DriftWatch(0.0)
    watch.add(seen(), 0.0)
    watch.add(MotionSample("gone", 0), 1.0)
    assert watch.doubtful
    told = watch.add(seen(4), 1.4)
    assert told.state == "knocked" and told.since == 1.0


def test_an_alarm_is_worded_anew_only_when_it_has_become_another():
    watch = DriftWatch(0.0)
    for second, px in enumerate((3.0, 3.0, 3.05, 2.9)):
        watch.add(seen(px), float(second))
    assert (
        "15 mm (3.0 px)" in watch.status.to_json()["sentence"]
        and watch.status.to_json()["px"] == 2.9
    )
    assert "30 mm (6.0 px)" in watch.add(seen(6.0), 5.0).to_json()["sentence"]


def test_words_say_no_noughts():
    assert sentence("steady", seen(0.004)) == "No movement detected (under 0.01 px, under 0.1 mm)."
    assert sentence("steady", seen(0.021)) == "No movement detected (0.02 px, 0.1 mm)."


def test_strays_have_no_say_in_the_motion(half_model):
    rng = np.random.default_rng(2)
    places = rng.uniform((40, 40), (600, 440), (80, 2))
    angle = rng.uniform(0, np.pi, 80)
    normals = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    flow = MotionField(half_model, (640, 480))
    across = np.einsum("ni,nik->nk", normals, flow.at(places))
    q = np.array([0.7, -0.4, 0.3, 0.1])
    off = np.sum(flow.shifts(places, q) * normals, axis=1) + rng.normal(0, 0.02, 80)
    off[:20] += rng.uniform(-1.2, 1.2, 20)
    found = estimate_motion(across, off, np.full(80, 0.02))
    assert found.q == pytest.approx(q, abs=0.05)
    assert found.agreeing[20:].mean() > 0.9 and found.agreeing[:20].mean() < 0.3


def test_lines_of_one_direction_tell_only_across_them():
    flow = MotionField(object(), (640, 480))  # no rays: shift, turn and growth
    places = np.stack([np.linspace(50, 590, 30), np.full(30, 200.0)], axis=1)
    across = flow.at(places)[:, 1]  # all run along the picture: they show only what goes up or down
    found = estimate_motion(across, np.full(30, 0.8), np.full(30, 0.05))
    assert found.sure > 6
    assert np.sqrt(found.covariance[0, 0]) > 100  # px: nobody knows how far along
