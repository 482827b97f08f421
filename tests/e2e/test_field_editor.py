"""A field of one's own: made, changed and deleted on the page, and used at once."""

import re

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import Operator
from tests.e2e.test_places import Keyboard
from tests.support.field_desk import (
    OBLIQUE,
    calibrate_without_clicks,
    camera_of,
    centre_of,
    copy,
    field_of,
    fill,
    named,
    save,
)
from tests.support.manual_pictures import manual_picture
from tests.support.words import t, titled


def check_lab_field(field_desk) -> None:
    lab, whole = field_of(field_desk, "lab-field"), field_of(field_desk, "ssl-div-b")
    assert (lab["title"], lab["length_mm"], lab["width_mm"], lab["own"]) == (
        "Lab field",
        4500,
        3000,
        True,
    )
    assert named(lab["lines"]).keys() == named(whole["lines"]).keys() - {"centre-line"}
    front = named(lab["lines"])["defence-left-front"]
    assert (front["from"], front["to"]) == ([-1750, -500], [-1750, 500])
    assert lab["arcs"][0]["radius_mm"] == 250 and lab["landmarks"]["circle-left"] == [-250, 0]
    assert (lab["regions"]["full"]["x"], lab["regions"]["full"]["y"]) == (
        [-2250, 2250],
        [-1500, 1500],
    )


def test_a_half_size_lab_field_is_made_by_mouse_and_calibrated_without_clicks(editor, field_desk):
    page, operator = editor, Operator(editor, field_desk)
    page.goto(f"{field_desk.url}/#/field")
    page.get_by_test_id("copy-field-ssl-div-b").click()
    fill(page, "title", "Lab field")
    fill(page, "length_mm", 4500)
    fill(page, "width_mm", 3000)
    page.get_by_test_id("on-centre-line").uncheck()
    save(page, "lab-field")
    check_lab_field(field_desk)
    calibrate_without_clicks(operator, "lab-field", f"sim://lab-field{OBLIQUE}", "lab")
    made = camera_of(field_desk, "lab")["active"]
    assert (
        made["field"] == "lab-field"
        and made["field_changes"] == []
        and made["verdict"]["level"] == "good"
    )


def test_it_is_made_by_the_keyboard_alone(editor, field_desk):
    keys = Keyboard(editor)
    editor.goto(f"{field_desk.url}/#/field")
    keys.press("copy-field-ssl-div-b")
    for entry, text in (("title", "Lab field"), ("length_mm", "4500"), ("width_mm", "3000")):
        keys.to(f"entry-{entry}")
        editor.keyboard.press("Control+a")
        editor.keyboard.type(text)
        editor.keyboard.press("Enter")
    keys.to("field-stage")
    editor.keyboard.press("Tab")  # the first marking
    while (
        titled("markings.centre-line") not in editor.get_by_test_id("field-read-out").inner_text()
    ):
        editor.keyboard.press("n")
    editor.keyboard.press("Delete")
    editor.keyboard.press("Control+s")
    expect(editor).to_have_url(re.compile(r"#/field/fields/lab-field$"))
    check_lab_field(field_desk)


def test_a_penalty_area_is_moved_with_all_that_belongs_to_it_and_one_undo_takes_it_back(
    editor, field_desk
):
    page, area = editor, ("front", "top", "bottom")
    copy(page, field_desk, "ssl-div-b")
    fill(page, "title", "Moved")
    page.get_by_test_id("mark-defence-left-front").click()
    (x, y0), (_, y1) = (centre_of(page, f"grip-{end}") for end in ("from", "to"))
    px_per_mm = abs(y1 - y0) / 2000
    for side in area[1:]:
        page.get_by_test_id(f"mark-defence-left-{side}").click(modifiers=["Shift"])
    manual_picture(page, "fields")
    page.mouse.move(x, y0 + 0.2 * (y1 - y0))
    page.mouse.down()
    page.mouse.move(x + 150 * px_per_mm, y0 + 0.2 * (y1 - y0), steps=3)
    page.mouse.move(x + 300 * px_per_mm, y0 + 0.2 * (y1 - y0), steps=3)
    page.mouse.up()
    save(page, "moved")
    before, after = field_of(field_desk, "ssl-div-b"), field_of(field_desk, "moved")
    by = (
        after["landmarks"]["defence-left-middle"][0] - before["landmarks"]["defence-left-middle"][0]
    )
    assert abs(by - 300) <= 15 and by % 5 == 0  # a pixel is some ten millimetres

    def shifted(field: dict) -> dict:
        lines = named(field["lines"])
        return lines | {
            f"defence-left-{side}": {
                **lines[f"defence-left-{side}"],
                **{
                    end: [
                        lines[f"defence-left-{side}"][end][0] + by,
                        lines[f"defence-left-{side}"][end][1],
                    ]
                    for end in ("from", "to")
                },
            }
            for side in area
        }

    assert named(after["lines"]) == shifted(before)
    moved = {
        name for name, place in after["landmarks"].items() if place != before["landmarks"][name]
    }
    assert moved == {
        f"defence-left-{spot}"
        for spot in ("corner-top", "foot-top", "corner-bottom", "foot-bottom", "middle")
    }
    assert after["regions"] == before["regions"]
    page.keyboard.press("Control+z")
    save(page, "moved")
    assert field_of(field_desk, "moved")["lines"] == before["lines"]


def drag(page, from_px, by_px, *keys):
    """Hold the keys, press there, move in two steps, release."""
    for key in keys:
        page.keyboard.down(key)
    page.mouse.move(*from_px)
    page.mouse.down()
    for share in (0.5, 1.0):
        page.mouse.move(from_px[0] + share * by_px[0], from_px[1] + share * by_px[1], steps=2)
    page.mouse.up()
    for key in keys:
        page.keyboard.up(key)


def test_ends_radii_and_edges_are_dragged_together_or_alone(editor, field_desk):
    copy(editor, field_desk, "ssl-div-b")
    fill(editor, "title", "Dragged")
    editor.get_by_test_id("mark-goal-line-right").click()
    editor.get_by_test_id("move-x").fill("-15")  # as taped
    editor.get_by_test_id("move-x").press("Enter")
    editor.get_by_test_id("mark-goal-line-left").click()
    # the corner at the top left, down the screen
    drag(editor, centre_of(editor, "grip-to"), (0, 20))
    editor.get_by_test_id("mark-halfway-line").click()
    drag(editor, centre_of(editor, "grip-to"), (0, 20), "Alt")
    editor.get_by_test_id("mark-centre-circle").click()
    drag(editor, centre_of(editor, "grip-radius"), (-20, 0))
    editor.get_by_test_id("mark-region-half-right").click()
    drag(editor, centre_of(editor, "grip-x0"), (-20, 0))
    save(editor, "dragged")
    now, before = field_of(field_desk, "dragged"), field_of(field_desk, "ssl-div-b")
    lines = named(now["lines"])
    corner = lines["goal-line-left"]["to"]
    assert (
        corner[1] < 2900
        and corner == lines["touch-line-top"]["from"] == now["landmarks"]["corner-top-left"]
    )
    assert lines["halfway-line"]["to"][1] < 2900 and now["landmarks"]["halfway-top"] == [0, 3000], (
        "alone"
    )
    radius = now["arcs"][0]["radius_mm"]
    assert radius > 600 and now["landmarks"]["circle-right"] == [radius, 0]
    assert (
        now["regions"]["half-right"]["x"][0] < -100 and now["regions"]["half-right"]["x"][1] == 4485
    )
    assert lines["touch-line-top"]["to"] == [4485, 3000] and now["landmarks"][
        "goal-right-post-top"
    ] == [4485, 500]
    assert now["regions"]["half-left"] == before["regions"]["half-left"]
    editor.get_by_test_id("mark-region-half-right").click()
    drag(editor, centre_of(editor, "grip-x0"), (60, 0))
    editor.keyboard.press("Control+z")
    expect(editor.get_by_test_id("entry-regions.half-right.x[0]")).to_have_value(
        f"{now['regions']['half-right']['x'][0]:g}"
    )


@pytest.mark.browser_context_args(
    viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True
)
def test_a_finger_reaches_every_number_below_the_drawing(new_context, field_desk):
    page = new_context().new_page()
    page.goto(f"{field_desk.url}/#/field/new-field/ssl-div-b")
    page.get_by_test_id("mark-halfway-line").tap()
    expect(page.get_by_test_id("field-read-out")).to_contain_text(titled("markings.halfway-line"))
    for entry in ("lines[4].to[0]", "width_mm", "title"):
        page.get_by_test_id(f"entry-{entry}").tap()
        expect(page.get_by_test_id(f"entry-{entry}")).to_be_focused()
        expect(page.get_by_test_id("field-stage")).to_be_in_viewport()


def test_what_was_refused_is_marked_and_shown(editor, field_desk):
    field_desk.api(
        "PUT",
        "/fields/mine",
        json={**field_of(field_desk, "table"), "name": "mine", "title": "Mine"},
    )
    copy(editor, field_desk, "table")
    fill(editor, "title", "Far away")
    fill(editor, "name", "mine")
    editor.get_by_test_id("next").click()
    expect(editor.get_by_test_id("field-refusal")).to_contain_text("already")
    expect(editor.get_by_test_id("entry-name")).to_have_attribute("aria-invalid", "true")
    assert field_of(field_desk, "mine")["title"] == "Mine"
    fill(editor, "name", "far-away")
    editor.get_by_test_id("mark-halfway-line").click()
    fill(editor, "lines[4].to[0]", 1e6)
    editor.get_by_test_id("mark-goal-line-left").click()
    editor.get_by_test_id("next").click()
    expect(editor.get_by_test_id("field-refusal")).to_contain_text("lines[4].to")
    expect(editor.get_by_test_id("entry-lines[4].to[0]")).to_have_attribute("aria-invalid", "true")
    expect(editor.get_by_test_id("entry-title")).not_to_have_attribute("aria-invalid", "true")
    fill(editor, "lines[4].to[0]", 0)
    save(editor, "far-away")
    fill(editor, "title", "")
    expect(editor.get_by_test_id("next")).to_be_disabled()


def test_of_two_who_change_a_field_neither_loses_anything(editor, field_desk):
    table = field_of(field_desk, "table")
    first = field_desk.api(
        "PUT", "/fields/mine", json={**table, "name": "mine", "title": "Mine"}
    ).json()
    editor.goto(f"{field_desk.url}/#/field/fields/mine")
    fill(editor, "title", "Mine, by page")
    field_desk.api("PUT", "/fields/mine", json={**first, "title": "Mine, by script"})
    editor.get_by_test_id("next").click()
    expect(editor.get_by_test_id("field-theirs")).to_be_visible()
    editor.get_by_test_id("take-theirs").click()
    expect(editor.get_by_test_id("entry-title")).to_have_value("Mine, by script")
    editor.get_by_test_id("field-stage").focus()
    editor.keyboard.press("Control+z")
    expect(editor.get_by_test_id("entry-title")).to_have_value("Mine, by page")
    editor.reload()
    # it was not saved yet
    expect(editor.get_by_test_id("entry-title")).to_have_value("Mine, by page")
    save(editor, "mine")
    assert field_of(field_desk, "mine")["title"] == "Mine, by page"
    editor.reload()
    expect(editor.get_by_test_id("next")).to_be_disabled()


def test_a_field_is_deleted_once_nothing_names_it_and_put_back(editor, field_desk):
    field_desk.api(
        "PUT",
        "/fields/mine",
        json={**field_of(field_desk, "table"), "name": "mine", "title": "Mine"},
    )
    field_desk.api(
        "POST",
        "/cameras",
        json={"id": "over", "name": "Over mine", "source": "sim://table", "field": "table"},
    )
    editor.goto(f"{field_desk.url}/#/field/fields/mine")
    editor.get_by_test_id("use-for").select_option("over")
    expect(editor.get_by_text(t("field-editor.use.under", cameras="Over mine"))).to_be_visible()
    editor.get_by_test_id("delete-field").click()
    expect(editor.get_by_test_id("field-refusal")).to_contain_text("the camera Over mine")
    field_desk.api("DELETE", "/cameras/over")
    editor.get_by_test_id("delete-field").click()
    expect(editor.get_by_test_id("field-page")).to_be_visible()
    assert field_desk.api("GET", "/fields/mine").status_code == 404
    editor.get_by_role("button", name=t("common.put-back")).click()
    expect(editor.get_by_test_id("field-card-mine")).to_be_visible()
    assert field_of(field_desk, "mine")["title"] == "Mine"


def test_a_geometry_packet_becomes_a_field(editor, field_desk):
    packet = field_desk.api("GET", "/fields/ssl-div-b/export/ssl-vision").content
    editor.goto(f"{field_desk.url}/#/field")
    editor.get_by_test_id("field-file").set_input_files(
        {"name": "field.pb", "mimeType": "", "buffer": packet}
    )
    expect(editor.get_by_test_id("entry-title")).to_have_value(
        "RoboCup Small Size League, Division B (2)"
    )
    fill(editor, "title", "From the network")
    save(editor, "from-the-network")
    assert (
        field_of(field_desk, "from-the-network")["lines"]
        == field_of(field_desk, "ssl-div-b")["lines"]
    )
