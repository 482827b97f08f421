"""Verify and activate: what is checked of a saved version, and that a bad one is not activated by mistake."""

import re

import numpy as np
import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.activation import activate_despite
from tests.support.axe import axe_path, grave
from tests.support.demo_cameras import CAMERAS
from tests.support.sim_clicks import border_clicks
from tests.support.waiting import until
from tests.support.words import like, t
from touchline.core.field import BORDERS
from touchline.core.field_json import field_from_json
from touchline.sources import SourceContext, source_from_url

TAPED = {"height_mm": {"value": 5000, "sigma": 20}}  # as the demo's overhead camera is placed
EAST = {"height_mm": {"value": 4000, "sigma": 20}}
NOISE_PX = 0.1  # as found by the program
DEMO = {"overhead": CAMERAS[0], "east": CAMERAS[1]}


@pytest.fixture
def kept(server):
    """A function that saves a version of a fresh picture of a demo's camera: its borders are clicked.

    beside_px: the upper one so far below its place.
    """

    def kept(camera: str, model: str, beside_px: float = 0.0, **options) -> dict:
        settings = DEMO[camera]
        field = field_from_json(server.api("GET", f"/fields/{settings['field']}").json())
        source = source_from_url(settings["source"], SourceContext(fields={field.name: field}))
        region = field.region(settings["region"])
        taken = until(
            lambda: server.api("POST", "/snapshots", json={"camera": camera}),
            # until then the camera's process is starting
            lambda answer: answer.status_code != 503,
        )
        answer = server.api(
            "POST",
            "/calibrations",
            json={
                "field": field.name,
                "region": region.name,
                "model": model,
                "options": options,
                "snapshot": taken.json()["id"],
                "camera": camera,
                "observations": [
                    {
                        "feature": name,
                        "kind": "line",
                        "points": np.add(
                            points[1:-1], [0, beside_px if name == "top" else 0]
                        ).tolist(),
                    }
                    for name, points in border_clicks(source.camera, region, 9, NOISE_PX).items()
                ],
            },
        )
        assert answer.ok, answer.text
        return answer.json()

    return kept


@pytest.fixture
def before(arriving):
    """A function that puts the operator before a saved version, where it is activated."""

    def before(version: dict):
        arriving.page.add_init_script(path=axe_path())
        draft = {name: version[name] for name in ("field", "region", "options", "observations")}
        return arriving.go_on(
            version["snapshot"], {**draft, "model": version["model"]["name"]}, "verify"
        )

    return before


def activate(server, version: dict) -> None:
    activate_despite(server, version["id"])


def active(server) -> str | None:
    return server.api("GET", "/cameras/overhead").json()["active_calibration"]


def state(page, check: str, wanted: str):
    item = page.get_by_test_id(f"check-{check}")
    expect(item).to_have_attribute("data-state", wanted, timeout=LONG_MS)
    return item


def shot(page, path) -> None:
    """Both themes, the whole checklist."""
    page.set_viewport_size({"width": 1280, "height": 1500})
    for theme in ("dark", "light"):
        page.emulate_media(color_scheme=theme)
        page.wait_for_timeout(300)
        page.screenshot(path=path.with_stem(f"{path.stem}-{theme}"))
    page.emulate_media(color_scheme="dark")
    page.set_viewport_size({"width": 1280, "height": 800})


def test_a_good_version_is_ready_and_is_activated_by_the_primary_button(
    kept, before, server, tmp_path
):
    activate(server, kept("east", "brown-conrady", **EAST))
    activate(server, kept("overhead", "polynomial"))
    good = kept("overhead", "brown-conrady", **TAPED)
    operator = before(good)
    page = operator.page
    leaving_ends_the_checks_and_a_refused_one_is_unknown(operator)
    expect(page.get_by_test_id("next")).to_have_text(
        t("common.activate-version", version=good["version"]), timeout=LONG_MS
    )
    nothing_wrong = re.compile("Ready to activate|No problems found")
    expect(page.get_by_test_id("headline")).to_have_text(nothing_wrong)
    expect(state(page, "lines", "ok")).to_contain_text("9 of 9 lines")
    state(page, "live-image", "ok")
    state(page, "region", "ok")
    operator.unfold("passed")
    expect(page.get_by_test_id("check-accuracy")).to_contain_text("mm")
    expect(state(page, "model", "ok")).to_contain_text("Brown–Conrady")
    expect(page.get_by_test_id("check-height")).to_contain_text("5.0 m")
    expect(state(page, "neighbour-east", "ok")).to_contain_text("mm")
    expect(page.get_by_test_id("check-lens")).to_have_count(0)  # the active one has no lens
    expect(state(page, "difference", "note")).to_contain_text("the largest difference is")
    expect(page.get_by_test_id("check-packet")).to_be_visible()
    expect(page.get_by_test_id("change-map")).to_contain_text(like("verify.change.caption"))
    assert not grave(page)
    shot(page, tmp_path / "ready.png")
    page.get_by_test_id("stage").focus()
    page.keyboard.press("Enter")  # once too often
    page.reload()  # the place is kept
    operator.is_at("verify")
    expect(page.get_by_test_id("headline")).to_have_text(nothing_wrong, timeout=LONG_MS)
    assert active(server) != good["id"]
    page.get_by_test_id("next").click()
    expect(page.get_by_test_id("notice").last).to_contain_text(
        t("versions.activated", version=good["version"], camera=DEMO["overhead"]["name"])
    )
    expect(page.get_by_test_id("camera-overhead")).to_be_visible()
    expect(page).to_have_url(re.compile(r"#/cameras$"))
    assert active(server) == good["id"]


def leaving_ends_the_checks_and_a_refused_one_is_unknown(operator):
    page = operator.page
    expect(page.get_by_test_id("headline")).not_to_have_text(t("verify.checking"), timeout=LONG_MS)
    looking = "**/calibrations/*/claims"
    answers = iter(
        [
            lambda route: None,
            lambda route: route.fulfill(  # the first is never answered
                status=503, json={"detail": "The server is busy.", "fix": "Try again."}
            ),
        ]
    )
    page.route(looking, lambda route: next(answers)(route))
    page.reload()
    operator.is_at("verify")
    state(page, "lines", "running")
    # what needs no picture is there at once
    operator.unfold("passed")
    expect(page.get_by_test_id("check-accuracy")).to_be_visible()
    expect(page.get_by_test_id("next")).to_have_text(t("verify.checking"))
    page.get_by_test_id("step-points").click()
    expect(page.get_by_test_id("checklist")).to_have_count(0)
    page.get_by_test_id("step-verify").click()
    expect(state(page, "lines", "unknown")).to_contain_text("The server is busy. Try again.")
    page.unroute(looking)
    page.reload()
    operator.is_at("verify")
    state(page, "lines", "ok")


def test_a_bad_version_is_activated_only_after_a_warning(kept, before, server, tmp_path):
    good = kept("overhead", "brown-conrady", **TAPED)
    activate(server, good)
    # by its borders alone: lines inside the field are misplaced
    bad = kept("overhead", "polynomial")
    page = before(bad).page
    primary, warning = page.get_by_test_id("next"), page.get_by_test_id("activation-warning")
    expect(primary).to_have_text(
        t("verify.activate-version-anyway", version=bad["version"]), timeout=LONG_MS
    )
    expect(page.get_by_test_id("headline")).to_contain_text(like("verify.headline.not-ready"))
    for check in ("lines", "accuracy", "model"):
        state(page, check, "bad")
    for check in ("height", "robot-tops"):  # a model without rays has none
        state(page, check, "unknown")
    shot(page, tmp_path / "not-ready.png")
    primary.focus()
    page.keyboard.press("Enter")
    expect(warning).to_be_visible()
    expect(page.get_by_test_id("activate-cancel")).to_be_focused()
    # as the robots cover them
    expect(warning).to_contain_text(re.compile("misplaced|not detected"))
    expect(warning.get_by_test_id("against-accuracy")).to_be_visible()
    assert not grave(page)
    page.screenshot(path=tmp_path / "warning.png")
    page.emulate_media(color_scheme="light")
    page.screenshot(path=tmp_path / "warning-light.png")
    page.keyboard.press("1")  # keys of the page are not meant
    page.keyboard.press("Escape")
    expect(warning).to_have_count(0)
    expect(primary).to_be_focused()
    assert active(server) == good["id"]
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("activate-cancel")).to_be_focused()
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("notice").last).to_contain_text(
        t("versions.activated", version=bad["version"], camera=DEMO["overhead"]["name"])
    )
    expect(page).to_have_url(re.compile(r"#/cameras$"))
    assert active(server) == bad["id"]


@pytest.mark.long
def test_a_neighbour_that_stands_elsewhere_and_another_lens_are_told(
    kept, before, server, tmp_path
):
    activate(server, kept("east", "brown-conrady", beside_px=15.0, **EAST))
    other = kept("overhead", "brown-conrady", height_mm={"value": 5600, "sigma": 20})
    activate(server, other)
    page = before(kept("overhead", "brown-conrady", **TAPED)).page
    neighbour = state(page, "neighbour-east", "bad")
    expect(neighbour).to_contain_text(f"Does not agree with {DEMO['east']['name']}")
    expect(neighbour.get_by_role("link")).to_have_attribute("href", "#/field")
    expect(state(page, "lens", "note")).to_contain_text(
        f"Lens differs from version {other['version']}"
    )
    expect(page.get_by_test_id("next")).to_have_text(
        re.compile(like("verify.activate-version-anyway").pattern + "$"), timeout=LONG_MS
    )
    shot(page, tmp_path / "neighbour.png")


def test_a_version_is_saved_before_the_models_are_compared_and_a_better_one_is_offered(
    operator, server, straight_picture, frame_points, tmp_path
):
    page, saved = operator.page, []
    page.on(
        "request",
        lambda sent: (
            sent.method == "POST" and sent.url.endswith("/calibrations") and saved.append(sent)
        ),
    )
    operator.open(straight_picture, "table", "full")
    for feature in BORDERS:
        operator.click(feature, frame_points[feature])
    operator.next("verify")
    first = operator.saved()
    assert [sent.post_data_json["compare"] for sent in saved] == [False]
    assert first["report"]["model_choice"]["ranking"] == []
    offer = page.get_by_test_id("model-offer")
    expect(offer).to_be_visible(timeout=LONG_MS)
    page.screenshot(path=tmp_path / "offer.png")
    page.get_by_test_id("do-save-recommended").click()
    expect(page.get_by_test_id("sentence")).to_contain_text(
        t("shell.sentence.version-saved", version=first["version"] + 1), timeout=LONG_MS
    )
    expect(offer).to_have_count(0)
    second = operator.saved()
    assert second["version"] == first["version"] + 1
    assert second["model"]["name"] != first["model"]["name"]
    assert operator.draft()["model"] == second["model"]["name"]


@pytest.mark.parametrize("size", [(1440, 900), (1024, 768)], ids=str)
def test_the_picture_has_two_thirds_of_the_window_and_every_border_is_in_sight(clicked, size):
    operator = clicked("brown-conrady")
    page = operator.page
    width, height = size
    page.set_viewport_size({"width": width, "height": height})
    for border in BORDERS:
        expect(page.get_by_test_id(f"border-{border}")).to_be_in_viewport(ratio=1)
    for go in (
        lambda: None,
        page.get_by_test_id("step-field").click,
        lambda: operator.next("points").next("verify"),
    ):
        go()
        expect(page.locator("aside")).to_have_count(1)
        picture = page.locator(".middle").bounding_box()
        assert picture["width"] * picture["height"] >= 0.65 * width * height
    steps, search, bar = (page.locator(it).bounding_box() for it in (".steps", ".search", "header"))
    go = page.get_by_test_id("next").bounding_box()
    assert (
        steps["x"] + steps["width"] <= search["x"]
    )  # a long label of the button is on none of them
    assert go["y"] >= bar["y"] and go["y"] + go["height"] <= bar["y"] + bar["height"]
    page.set_viewport_size({"width": 1440, "height": 900})
    expect(page.get_by_test_id("fold-passed")).to_be_visible(timeout=LONG_MS)
    assert page.locator("aside").evaluate("panel => panel.scrollHeight") < 1300
