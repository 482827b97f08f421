"""A field of one's own: made, changed, measured and deleted on the page, and used at once."""

import re

import pytest
from playwright.sync_api import Page, expect

from app.core.field_json import field_from_json
from app.core.field_moves import JoinedField
from app.sources import SourceContext, source_from_url
from tests.e2e.conftest import LONG_MS, Operator, Server
from tests.e2e.test_places import Keyboard
from tests.support.sim_clicks import border_clicks
from tests.support.tape import SIDES_AND_DIAGONALS, measured
from tests.support.waiting import until

OBLIQUE = "?size=640x512&fps=5&robots=0&tilt=15&lens=mild"  # from straight above no picture tells the height


@pytest.fixture(scope="module")
def desk(tmp_path_factory):
    """A server whose fields and cameras are this file's."""
    server = Server(tmp_path_factory.mktemp("fields"))
    yield server
    server.stop()


@pytest.fixture
def editor(page: Page, desk):
    """The page; an error in its own code fails the test. Fields that a test has made are gone after it."""
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.set_default_timeout(LONG_MS)
    yield page
    assert not errors
    page.goto("about:blank")
    for camera in desk.api("GET", "/cameras").json()["items"]:
        if camera["editable"]:
            desk.api("DELETE", f"/cameras/{camera['id']}")
    for field in desk.api("GET", "/fields").json()["items"]:
        if field["own"]:
            assert desk.api("DELETE", f"/fields/{field['name']}").status_code == 204


def field_of(desk, name: str) -> dict:
    return desk.api("GET", f"/fields/{name}").json()


def named(entries: list[dict]) -> dict[str, dict]:
    return {entry["name"]: entry for entry in entries}


def fill(page: Page, entry: str, text: object) -> None:
    box = page.get_by_test_id(f"entry-{entry}")
    box.fill(str(text))
    box.press("Enter")


def save(page: Page, name: str) -> None:
    with page.expect_response(lambda answer: answer.request.method == "PUT") as saved:
        page.get_by_test_id("next").click()
    assert saved.value.ok, saved.value.text()
    expect(page).to_have_url(re.compile(rf"#/library/fields/{name}$"))


def copy(page: Page, desk, name: str) -> None:
    page.goto(f"{desk.url}/#/library/new-field/{name}")
    expect(page.get_by_test_id("field-editor")).to_be_visible()


def check_lab_field(desk) -> None:
    lab, whole = field_of(desk, "lab-field"), field_of(desk, "ssl-div-b")
    assert (lab["title"], lab["length_mm"], lab["width_mm"], lab["own"]) == ("Lab field", 4500, 3000, True)
    assert named(lab["lines"]).keys() == named(whole["lines"]).keys() - {"centre-line"}
    front = named(lab["lines"])["defence-left-front"]
    assert (front["from"], front["to"]) == ([-1750, -500], [-1750, 500])
    assert lab["arcs"][0]["radius_mm"] == 250 and lab["landmarks"]["circle-left"] == [-250, 0]
    assert (lab["regions"]["full"]["x"], lab["regions"]["full"]["y"]) == ([-2250, 2250], [-1500, 1500])


def test_a_half_size_lab_field_is_made_by_mouse_and_calibrated_without_clicks(editor, desk):
    page, operator = editor, Operator(editor, desk)
    operator.prefer("detect", "on")
    page.goto(f"{desk.url}/#/library/fields")
    page.get_by_test_id("copy-field-ssl-div-b").click()
    fill(page, "title", "Lab field")
    fill(page, "length_mm", 4500)
    fill(page, "width_mm", 3000)
    page.get_by_test_id("on-centre-line").uncheck()
    save(page, "lab-field")
    check_lab_field(desk)
    desk.api("POST", "/cameras", json={"id": "lab", "name": "Lab camera", "field": "lab-field", "region": "full",
                                       "source": f"sim://lab-field{OBLIQUE}"})
    page.goto(f"{desk.url}/#/cameras")
    page.get_by_test_id("camera-lab").click()
    operator.is_at("points")
    expect(page.get_by_test_id("lines-found")).to_be_visible(timeout=LONG_MS)
    operator.next("verify")
    operator.activate(warned=False)
    made = next(c for c in desk.api("GET", "/cameras").json()["items"] if c["id"] == "lab")["active"]
    assert made["field"] == "lab-field" and made["field_changes"] == [] and made["verdict"]["level"] == "good"


def test_it_is_made_by_the_keyboard_alone(editor, desk):
    keys = Keyboard(editor)
    editor.goto(f"{desk.url}/#/library/fields")
    keys.press("copy-field-ssl-div-b")
    for entry, text in (("title", "Lab field"), ("length_mm", "4500"), ("width_mm", "3000")):
        keys.to(f"entry-{entry}")
        editor.keyboard.press("Control+a")
        editor.keyboard.type(text)
        editor.keyboard.press("Enter")
    keys.to("field-stage")
    editor.keyboard.press("Tab")  # the first marking
    while "Centre line" not in editor.get_by_test_id("field-read-out").inner_text():
        editor.keyboard.press("n")
    editor.keyboard.press("Delete")
    editor.keyboard.press("Control+s")
    expect(editor).to_have_url(re.compile(r"#/library/fields/lab-field$"))
    check_lab_field(desk)


def test_a_penalty_area_is_moved_with_all_that_belongs_to_it_and_one_undo_takes_it_back(editor, desk):
    page, area = editor, ("front", "top", "bottom")
    copy(page, desk, "ssl-div-b")
    fill(page, "title", "Moved")
    page.get_by_test_id("mark-defence-left-front").click()
    (x, y0), (_, y1) = (centre_of(page, f"grip-{end}") for end in ("from", "to"))
    px_per_mm = abs(y1 - y0) / 2000
    for side in area[1:]:
        page.get_by_test_id(f"mark-defence-left-{side}").click(modifiers=["Shift"])
    page.mouse.move(x, y0 + 0.2 * (y1 - y0))
    page.mouse.down()
    page.mouse.move(x + 150 * px_per_mm, y0 + 0.2 * (y1 - y0), steps=3)
    page.mouse.move(x + 300 * px_per_mm, y0 + 0.2 * (y1 - y0), steps=3)
    page.mouse.up()
    save(page, "moved")
    before, after = field_of(desk, "ssl-div-b"), field_of(desk, "moved")
    by = after["landmarks"]["defence-left-middle"][0] - before["landmarks"]["defence-left-middle"][0]
    assert abs(by - 300) <= 15 and by % 5 == 0  # a pixel is some ten millimetres

    def shifted(field: dict) -> dict:
        lines = named(field["lines"])
        return lines | {f"defence-left-{side}": {**lines[f"defence-left-{side}"], **{
            end: [lines[f"defence-left-{side}"][end][0] + by, lines[f"defence-left-{side}"][end][1]]
            for end in ("from", "to")}} for side in area}
    assert named(after["lines"]) == shifted(before)
    moved = {name for name, place in after["landmarks"].items() if place != before["landmarks"][name]}
    assert moved == {f"defence-left-{spot}" for spot in (
        "corner-top", "foot-top", "corner-bottom", "foot-bottom", "middle")}
    assert after["regions"] == before["regions"]
    page.keyboard.press("Control+z")
    save(page, "moved")
    assert field_of(desk, "moved")["lines"] == before["lines"]


def centre_of(page: Page, grip: str) -> tuple[float, float]:
    box = page.get_by_test_id(grip).first.bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def test_a_line_taped_elsewhere_takes_with_it_what_ends_on_it_and_the_edges_of_parts(editor, desk):
    copy(editor, desk, "ssl-div-b")
    fill(editor, "title", "Taped")
    editor.get_by_test_id("mark-goal-line-right").click()
    editor.get_by_test_id("move-x").fill("-15")
    editor.get_by_test_id("move-x").press("Enter")
    save(editor, "taped")
    taped = field_of(desk, "taped")
    assert named(taped["lines"])["touch-line-top"]["to"] == [4485, 3000]
    assert named(taped["lines"])["centre-line"]["to"] == [4485, 0]
    assert taped["landmarks"]["goal-right-post-top"] == [4485, 500]
    assert taped["regions"]["half-right"]["x"] == [0, 4485] and taped["regions"]["half-left"]["x"] == [-4500, 0]


def test_every_field_that_comes_with_touchline_passes_through_the_editor_unchanged(editor, desk):
    for field in desk.api("GET", "/fields").json()["items"]:
        if field["own"]:
            continue
        copy(editor, desk, field["name"])
        fill(editor, "title", f"{field['name']} again")
        fill(editor, "title", field["title"])
        fill(editor, "name", f"{field['name']}-again")
        save(editor, f"{field['name']}-again")
        made, shipped = (desk.api("GET", f"/fields/{name}/export/json").text
                         for name in (f"{field['name']}-again", field["name"]))
        assert made.replace(f'"name": "{field["name"]}-again"', f'"name": "{field["name"]}"') == shipped


def test_what_was_refused_is_marked_and_shown(editor, desk):
    copy(editor, desk, "table")
    fill(editor, "title", "Far away")
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


def test_a_name_that_is_taken_is_refused(editor, desk):
    desk.api("PUT", "/fields/mine", json={**field_of(desk, "table"), "name": "mine", "title": "Mine"})
    copy(editor, desk, "table")
    fill(editor, "name", "mine")
    editor.get_by_test_id("next").click()
    expect(editor.get_by_test_id("field-refusal")).to_contain_text("already")
    expect(editor.get_by_test_id("entry-name")).to_have_attribute("aria-invalid", "true")
    assert field_of(desk, "mine")["title"] == "Mine"


def test_of_two_who_change_a_field_neither_loses_anything(editor, desk):
    first = desk.api("PUT", "/fields/mine", json={**field_of(desk, "table"), "name": "mine", "title": "Mine"}).json()
    editor.goto(f"{desk.url}/#/library/fields/mine")
    fill(editor, "title", "Mine, by page")
    desk.api("PUT", "/fields/mine", json={**first, "title": "Mine, by script"})
    editor.get_by_test_id("next").click()
    expect(editor.get_by_test_id("field-theirs")).to_be_visible()
    editor.get_by_test_id("take-theirs").click()
    expect(editor.get_by_test_id("entry-title")).to_have_value("Mine, by script")
    editor.get_by_test_id("field-stage").focus()
    editor.keyboard.press("Control+z")
    expect(editor.get_by_test_id("entry-title")).to_have_value("Mine, by page")
    editor.reload()
    expect(editor.get_by_test_id("entry-title")).to_have_value("Mine, by page")  # it was not saved yet
    save(editor, "mine")
    assert field_of(desk, "mine")["title"] == "Mine, by page"
    editor.reload()
    expect(editor.get_by_test_id("next")).to_be_disabled()


def test_a_field_is_deleted_once_nothing_names_it_and_put_back(editor, desk):
    desk.api("PUT", "/fields/mine", json={**field_of(desk, "table"), "name": "mine", "title": "Mine"})
    desk.api("POST", "/cameras", json={"id": "over", "name": "Over mine", "source": "sim://table", "field": "table"})
    editor.goto(f"{desk.url}/#/library/fields/mine")
    editor.get_by_test_id("use-for").select_option("over")
    expect(editor.get_by_text("Under Over mine.")).to_be_visible()
    editor.get_by_test_id("delete-field").click()
    expect(editor.get_by_test_id("field-refusal")).to_contain_text("the camera Over mine")
    desk.api("DELETE", "/cameras/over")
    editor.get_by_test_id("delete-field").click()
    expect(editor.get_by_test_id("fields-page")).to_be_visible()
    assert desk.api("GET", "/fields/mine").status_code == 404
    editor.get_by_role("button", name="Put it back").click()
    expect(editor.get_by_test_id("field-card-mine")).to_be_visible()
    assert field_of(desk, "mine")["title"] == "Mine"


def test_a_geometry_packet_becomes_a_field(editor, desk):
    packet = desk.api("GET", "/fields/ssl-div-b/export/ssl-vision").content
    editor.goto(f"{desk.url}/#/library/fields")
    editor.get_by_test_id("field-file").set_input_files({"name": "field.pb", "mimeType": "", "buffer": packet})
    expect(editor.get_by_test_id("entry-title")).to_have_value("RoboCup Small Size League, Division B (2)")
    fill(editor, "title", "From the network")
    save(editor, "from-the-network")
    assert field_of(desk, "from-the-network")["lines"] == field_of(desk, "ssl-div-b")["lines"]


def test_an_open_draft_follows_its_field_and_an_outdated_calibration_is_made_again(editor, desk):
    page, operator = editor, Operator(editor, desk)
    own = {**field_of(desk, "ssl-div-b"), "name": "hall", "title": "Hall"}
    desk.api("PUT", "/fields/hall", json=own)
    desk.api("POST", "/cameras", json={"id": "hall", "name": "Hall camera", "field": "hall", "region": "full",
                                       "source": f"sim://hall{OBLIQUE}"})
    operator.prefer("detect", "on")
    page.goto(f"{desk.url}/#/cameras")
    page.get_by_test_id("camera-hall").click()
    expect(page.get_by_test_id("lines-found")).to_be_visible(timeout=LONG_MS)
    operator.next("verify")
    operator.activate(warned=False)
    before = camera_of(desk, "hall")["active"]["id"]
    page.go_back()
    operator.is_at("verify")
    page.get_by_test_id("step-points").click()
    lines = [line for line in own["lines"] if line["name"] != "centre-line"]
    arcs = [{**own["arcs"][0], "radius_mm": 515.0}]
    with page.expect_request("**/fit/attempt") as asked:  # the fit is another one
        desk.api("PUT", "/fields/hall", json={**own, "lines": lines, "arcs": arcs})
    assert "centre-line" not in {o["feature"] for o in asked.value.post_data_json["observations"]}
    assert "centre-line" in {o["feature"] for o in operator.draft()["observations"]}, "what was clicked is kept"
    page.goto(f"{desk.url}/#/cameras/hall/versions")
    expect(page.get_by_test_id("outdated")).to_contain_text("centre line, centre circle")
    expect(page.get_by_test_id("field-changed")).to_have_count(1)
    page.get_by_test_id("calibrate-again").click()
    expect(page.get_by_test_id("shelf-version")).to_have_count(2)
    again = page.locator("[data-testid=shelf-version][data-version='2']")
    expect(again.get_by_test_id("field-changed")).to_have_count(0)
    again.get_by_test_id("shelf-activate").click()
    expect(page.get_by_test_id("outdated")).to_have_count(0)
    now = until(lambda: camera_of(desk, "hall")["active"], lambda active: active["id"] != before)
    assert now["field_changes"] == []


def worst_mm(found: dict, truth) -> float:
    """How far any line's end is from where it truly is."""
    return max(abs(a - b) for line in found["lines"] for end, place in (
        ("from", truth.lines[line["name"]].start), ("to", truth.lines[line["name"]].end))
        for a, b in zip(line[end], place, strict=True))


def test_lines_taped_elsewhere_are_found_by_tape_and_adopted(editor, desk):
    nominal = field_from_json(field_of(desk, "ssl-div-b"))
    truth = JoinedField(nominal).moved({"goal-line-right": (-15.0, -15.0), "halfway-line": (15.0, 15.0)}, {})
    copy(editor, desk, "ssl-div-b")
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
    expect(editor.get_by_test_id("found-offsets")).to_contain_text("Goal line right")
    expect(editor.get_by_test_id("found-offsets")).to_contain_text("±")
    editor.reload()
    expect(editor.get_by_test_id("distance-12-mm")).not_to_have_value("")  # what was typed is there
    save(editor, "measured")
    assert worst_mm(field_of(desk, "measured"), truth) < 3
    expect(editor.get_by_test_id("distance-12-mm")).not_to_have_value("")


def test_what_a_calibration_found_of_the_lines_is_adopted(editor, desk):
    page, operator = editor, Operator(editor, desk)
    nominal = {**field_of(desk, "ssl-div-b"), "name": "nominal", "title": "Nominal"}
    truth = JoinedField(field_from_json(nominal)).moved({"defence-left-front": (15.0, 15.0)}, {})
    desk.api("PUT", "/fields/nominal", json=nominal)
    desk.api("PUT", "/fields/truth", json={**truth.to_json(), "name": "truth"})
    desk.api("POST", "/cameras", json={"id": "taped", "name": "Taped camera", "field": "nominal", "region": "full",
                                       "source": f"sim://truth{OBLIQUE}".replace("640x512", "1280x1024")})
    operator.prefer("detect", "on")
    page.goto(f"{desk.url}/#/cameras")
    page.get_by_test_id("camera-taped").click()
    expect(page.get_by_test_id("lines-found")).to_be_visible(timeout=LONG_MS)
    operator.next("verify")
    operator.activate(warned=False)
    page.goto(f"{desk.url}/#/library/fields/nominal")
    page.get_by_test_id("fold-measured").locator("summary").click()
    page.get_by_test_id("adopt-offsets").select_option(label="Taped camera, version 1")
    expect(page.get_by_test_id("found-offsets")).to_contain_text("Defence left front")
    save(page, "nominal")
    assert worst_mm(field_of(desk, "nominal"), truth) < 3
    expect(page.get_by_test_id("outdated")).to_contain_text("Taped camera")
    page.get_by_test_id("calibrate-again").click()
    expect(page.get_by_test_id("notice").last).to_contain_text("1 new version on the field as it is now")


def test_lines_that_a_calibrated_image_shows_are_added_to_a_field_of_borders_alone(editor, desk):
    whole = field_of(desk, "ssl-div-b")
    borders = [line for line in whole["lines"] if line["name"].startswith(("touch", "goal"))]
    desk.api("PUT", "/fields/bare", json={**whole, "name": "bare", "title": "Bare", "lines": borders, "arcs": []})
    source = f"sim://ssl-div-b{OBLIQUE}".replace("640x512", "1280x1024")
    desk.api("POST", "/cameras", json={"id": "bare", "name": "Bare camera", "field": "bare", "region": "full",
                                       "source": source})
    field = field_from_json(whole)
    camera = source_from_url(source, SourceContext({field.name: field})).camera
    clicks = [{"feature": name, "kind": "line", "points": points} for name, points in border_clicks(
        camera, field.region("full"), 15, 0.3).items()]
    picture = desk.api("POST", "/snapshots", json={"camera": "bare"}).json()["id"]
    made = desk.api("POST", "/calibrations", json={
        "snapshot": picture, "camera": "bare", "field": "bare", "region": "full", "model": "brown-conrady",
        "observations": clicks, "options": {"height_mm": {"value": camera.position_mm[2], "sigma": 20}}}).json()
    desk.api("POST", f"/calibrations/{made['id']}/activate")
    editor.goto(f"{desk.url}/#/library/fields/bare")
    editor.get_by_test_id("fold-measured").locator("summary").click()
    editor.get_by_test_id("add-seen").select_option(label="Bare camera, version 1")
    expect(editor.get_by_test_id("found-seen")).to_contain_text("9 markings were added")
    expect(editor.get_by_test_id("chosen")).to_contain_text("9 chosen")
    save(editor, "bare")
    found = field_of(desk, "bare")
    assert len(found["lines"]) == 12 and found["arcs"][0]["radius_mm"] == pytest.approx(500, abs=5)
    editor.keyboard.press("Control+z")
    expect(editor.get_by_test_id("mark-line-1")).to_have_count(0)


def camera_of(desk, id: str) -> dict:
    return next(c for c in desk.api("GET", "/cameras").json()["items"] if c["id"] == id)
