"""A field as it is: by tape, by what a calibration found of its lines, from a picture; and what follows a change."""

import numpy as np
import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS, Operator, press_activate
from tests.support.activation import activate_despite
from tests.support.field_desk import (
    OBLIQUE,
    calibrate_without_clicks,
    camera_of,
    copy,
    field_of,
    fill,
    save,
)
from tests.support.sim_clicks import border_clicks
from tests.support.tape import SIDES_AND_DIAGONALS, measured
from tests.support.waiting import until
from tests.support.words import t, titled
from touchline.core.field_json import field_from_json
from touchline.fields.measuring import JoinedField
from touchline.sources import SourceContext, source_from_url


def test_an_open_draft_follows_its_field_and_an_outdated_calibration_is_made_again(
    editor, field_desk
):
    page, operator = editor, Operator(editor, field_desk)
    own = {**field_of(field_desk, "ssl-div-b"), "name": "hall", "title": "Hall"}
    field_desk.api("PUT", "/fields/hall", json=own)
    calibrate_without_clicks(operator, "hall", f"sim://hall{OBLIQUE}", "hall")
    before = camera_of(field_desk, "hall")["active"]["id"]
    page.go_back()
    operator.is_at("verify")
    page.get_by_test_id("step-points").click()
    lines = [line for line in own["lines"] if line["name"] != "centre-line"]
    arcs = [{**own["arcs"][0], "radius_mm": 515.0}]
    with page.expect_request("**/fit/attempt?*") as asked:  # the fit is another one
        field_desk.api("PUT", "/fields/hall", json={**own, "lines": lines, "arcs": arcs})
    assert "centre-line" not in {o["feature"] for o in asked.value.post_data_json["observations"]}
    assert "centre-line" in {o["feature"] for o in operator.draft()["observations"]}, (
        "what was clicked is kept"
    )
    page.goto(f"{field_desk.url}/#/cameras")
    expect(page.get_by_test_id("claim-cameras-field")).to_contain_text(
        "The hall camera", timeout=LONG_MS
    )
    expect(page.get_by_test_id("readiness")).to_have_attribute("data-gate", "problems")
    page.goto(f"{field_desk.url}/#/cameras/hall/versions")
    changed = f"{t('markings.centre-line')}, {t('markings.centre-circle')}"
    expect(page.get_by_test_id("outdated")).to_contain_text(changed)
    expect(page.get_by_test_id("field-changed")).to_have_count(1)
    page.get_by_test_id("calibrate-again").click()
    expect(page.get_by_test_id("shelf-version")).to_have_count(2)
    again = page.locator("[data-testid=shelf-version][data-version='2']")
    expect(again.get_by_test_id("field-changed")).to_have_count(0)
    press_activate(page, again.get_by_test_id("shelf-activate"))
    expect(page.get_by_test_id("outdated")).to_have_count(0)
    now = until(
        lambda: camera_of(field_desk, "hall")["active"], lambda active: active["id"] != before
    )
    assert now["field_changes"] == []


def worst_mm(found: dict, truth) -> float:
    """How far any line's end is from where it truly is."""
    return max(
        abs(a - b)
        for line in found["lines"]
        for end, place in (
            ("from", truth.lines[line["name"]].start),
            ("to", truth.lines[line["name"]].end),
        )
        for a, b in zip(line[end], place, strict=True)
    )


def test_lines_taped_elsewhere_are_found_by_tape_and_adopted(editor, field_desk):
    nominal = field_from_json(field_of(field_desk, "ssl-div-b"))
    truth = JoinedField(nominal).moved(
        {"goal-line-right": (-15.0, -15.0), "halfway-line": (15.0, 15.0)}, {}
    )
    copy(editor, field_desk, "ssl-div-b")
    fill(editor, "title", "Measured")
    editor.get_by_test_id("fold-measured").locator("summary").click()
    for i, (a, b, mm) in enumerate(measured(truth, SIDES_AND_DIAGONALS, noise_mm=1.0)):
        editor.get_by_test_id("add-distance").click()
        editor.get_by_test_id(f"distance-{i}-from").select_option(a)
        editor.get_by_test_id(f"distance-{i}-to").select_option(b)
        box = editor.get_by_test_id(f"distance-{i}-mm")
        box.fill(f"{mm:.0f}")
        box.press("Enter")
    editor.get_by_test_id("adjust-to-tape").click()
    expect(editor.get_by_test_id("found-offsets")).to_contain_text(
        titled("markings.goal-line-right")
    )
    expect(editor.get_by_test_id("found-offsets")).to_contain_text("±")
    editor.reload()
    expect(editor.get_by_test_id("distance-12-mm")).not_to_have_value("")  # what was typed is there
    save(editor, "measured")
    assert worst_mm(field_of(field_desk, "measured"), truth) < 3
    expect(editor.get_by_test_id("distance-12-mm")).not_to_have_value("")
    copy(editor, field_desk, "ssl-div-b")  # another field, on which nobody has measured
    expect(editor.get_by_test_id("add-distance")).to_be_visible()
    expect(editor.get_by_test_id("distance-0-mm")).to_have_count(0)


def test_what_a_calibration_found_of_the_lines_is_adopted(editor, field_desk):
    page, operator = editor, Operator(editor, field_desk)
    nominal = {**field_of(field_desk, "ssl-div-b"), "name": "nominal", "title": "Nominal"}
    truth = JoinedField(field_from_json(nominal)).moved({"defence-left-front": (15.0, 15.0)}, {})
    field_desk.api("PUT", "/fields/nominal", json=nominal)
    field_desk.api("PUT", "/fields/truth", json={**truth.to_json(), "name": "truth"})
    source = f"sim://truth{OBLIQUE}".replace("640x512", "1280x1024")
    calibrate_without_clicks(operator, "nominal", source, "taped")
    page.goto(f"{field_desk.url}/#/field/fields/nominal")
    page.get_by_test_id("fold-measured").locator("summary").click()
    page.get_by_test_id("adopt-offsets").select_option(
        label=t("field-editor.measured.version", camera="The taped camera", version=1)
    )
    expect(page.get_by_test_id("found-offsets")).to_contain_text(
        titled("markings.defence-left-front")
    )
    save(page, "nominal")
    assert worst_mm(field_of(field_desk, "nominal"), truth) < 3
    expect(page.get_by_test_id("outdated")).to_contain_text("The taped camera")
    page.get_by_test_id("calibrate-again").click()
    expect(page.get_by_test_id("notice").last).to_contain_text(t("versions.outdated.made", count=1))


def test_lines_that_a_calibrated_image_shows_are_added_to_a_field_of_borders_alone(
    editor, field_desk
):
    whole = field_of(field_desk, "ssl-div-b")
    borders = [line for line in whole["lines"] if line["name"].startswith(("touch", "goal"))]
    field_desk.api(
        "PUT",
        "/fields/bare",
        json={**whole, "name": "bare", "title": "Bare", "lines": borders, "arcs": []},
    )
    source = f"sim://ssl-div-b{OBLIQUE}".replace("640x512", "1280x1024")
    field_desk.api(
        "POST",
        "/cameras",
        json={
            "id": "bare",
            "name": "Bare camera",
            "field": "bare",
            "region": "full",
            "source": source,
        },
    )
    field = field_from_json(whole)
    camera = source_from_url(source, SourceContext({field.name: field})).camera
    clicks = [
        {"feature": name, "kind": "line", "points": np.asarray(points).tolist()}
        for name, points in border_clicks(camera, field.region("full"), 15, 0.3).items()
    ]
    picture = field_desk.api("POST", "/snapshots", json={"camera": "bare"}).json()["id"]
    made = field_desk.api(
        "POST",
        "/calibrations",
        json={
            "snapshot": picture,
            "camera": "bare",
            "field": "bare",
            "region": "full",
            "model": "brown-conrady",
            "observations": clicks,
            "options": {"height_mm": {"value": camera.position_mm[2], "sigma": 20}},
        },
    ).json()
    activate_despite(field_desk, made["id"])
    editor.goto(f"{field_desk.url}/#/field/fields/bare")
    editor.get_by_test_id("fold-measured").locator("summary").click()
    editor.get_by_test_id("add-seen").select_option(
        label=t("field-editor.measured.version", camera="Bare camera", version=1)
    )
    expect(editor.get_by_test_id("found-seen")).to_contain_text(
        t("field-editor.measured.added", count=9)
    )
    expect(editor.get_by_test_id("chosen")).to_contain_text(t("field-editor.chosen.count", count=9))
    save(editor, "bare")
    found = field_of(field_desk, "bare")
    assert len(found["lines"]) == 12 and found["arcs"][0]["radius_mm"] == pytest.approx(500, abs=5)
    editor.keyboard.press("Control+z")
    expect(editor.get_by_test_id("mark-line-1")).to_have_count(0)
