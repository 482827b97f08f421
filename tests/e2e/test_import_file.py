"""Calibrations that exist already, by the page: chosen or dropped, kept as new versions, or refused with a cure."""

import json
import re

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import CLICKS, LONG_MS, press_activate
from tests.support.bar_pictures import bars_behind
from tests.support.pictures import encoded
from tests.support.waiting import until
from tests.support.words import like, t
from touchline.core.geometry import ImageSize
from touchline.models.intrinsics import Intrinsics


@pytest.fixture
def exported(server):
    """The bytes of a kept calibration in a format."""
    task = json.loads((CLICKS / "ssl_2008_half.json").read_text())
    it = server.api("POST", "/calibrations", json={**task, "model": "brown-conrady"}).json()
    return lambda format: server.api("GET", f"/calibrations/{it['id']}/export/{format}").content


@pytest.fixture
def camera(server, request):
    """One of its own: what is activated here is of a picture of another size than the demo's cameras give."""
    id = getattr(request, "param", "importing")
    made = server.api(
        "POST",
        "/cameras",
        json={
            "id": id,
            "name": "Importing",
            "field": "ssl-div-b",
            "region": "half",
            "source": "sim://ssl-div-b?size=320x256&fps=3",
        },
    )
    assert made.status_code == 201, made.text
    yield id
    server.api("DELETE", f"/cameras/{id}")


def start(page, server):
    page.goto(server.url + "/#/library/import")
    expect(page.get_by_test_id("import-file")).to_be_enabled(timeout=LONG_MS)


def file_of(name, data, kind="application/octet-stream"):
    return {"name": name, "mimeType": kind, "buffer": data}


def test_a_file_is_chosen_by_keyboard_and_becomes_a_new_version_that_can_be_activated(
    exported, server, page, camera, tmp_path
):
    data = exported("opencv")
    start(page, server)
    page.get_by_text(t("versions.import.beside")).click()
    page.get_by_test_id("import-camera").select_option(camera)
    with page.expect_file_chooser() as chooser:
        # in the page itself: it knows by then that a chooser is waited for
        page.get_by_test_id("import-file").focus()
        page.keyboard.press("Enter")
    chooser.value.set_files(file_of("north.yml", data))
    imported = like("versions.import.imported-for", camera="Importing")
    expect(page.get_by_test_id("imported")).to_contain_text(imported, timeout=LONG_MS)
    said = re.search(
        imported.pattern.replace(".*?", r"(\d+)"), page.get_by_test_id("imported").inner_text()
    )
    listed = server.api("GET", f"/calibrations?camera={camera}").json()["items"]
    kept = next(it for it in listed if it["version"] == int(said[1]))
    assert "Imported from" in kept["note"] and kept["made_by"]
    page.screenshot(path=tmp_path / "imported.png")
    press_activate(page, page.get_by_test_id("import-activate"))
    activated = t("versions.activated", version=kept["version"], camera="Importing")
    expect(page.get_by_text(activated)).to_be_visible(timeout=LONG_MS)
    assert server.api("GET", f"/calibrations/{kept['id']}").json()["active"]


def test_what_a_file_does_not_say_is_asked_for_where_it_was_refused(server, page):
    """Two cameras, of which the second states no lens: two presses, and it is a lens."""
    numbers = "{fx: 350, fy: 351, cx: 640, cy: 480, width: 1280, height: 960"
    stereo = f"left: {numbers}, k1: -0.1, k2: 0.01, p1: 0, p2: 0}}\nright: {numbers}, D: [0.1, 0, 0, 0]}}\n"
    start(page, server)
    page.get_by_test_id("import-file").set_input_files(file_of("stereo.txt", stereo.encode()))
    refusal = page.get_by_test_id("import-refusal")
    expect(refusal).to_contain_text("left, right", timeout=LONG_MS)
    refusal.get_by_role("button", name="right").click()
    choices = page.get_by_test_id("import-choice")
    fisheye = choices.get_by_text(t("versions.import.lens.fisheye"))
    expect(fisheye).to_be_visible(timeout=LONG_MS)
    fisheye.focus()
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("imported")).to_contain_text(
        t("versions.import.lens-imported"), timeout=LONG_MS
    )
    newest = server.api("GET", "/lenses").json()["items"][0]
    assert newest["model"] == "fisheye"


def test_every_camera_of_a_chain_is_imported_by_one_press(server, page):
    lens = "camera_model: pinhole, distortion_model: equidistant, distortion_coeffs: [0.1, 0, 0, 0]"
    chain = "".join(
        f"cam{i}: {{{lens}, intrinsics: [{350 + i}, 351, 640, 480], resolution: [1280, 960]}}\n"
        for i in range(3)
    )
    before = len(server.api("GET", "/lenses").json()["items"])
    start(page, server)
    page.get_by_test_id("import-file").set_input_files(file_of("chain.yaml", chain.encode()))
    page.get_by_role("button", name=t("versions.import.every-camera"), exact=True).click()

    def lenses():
        return server.api("GET", "/lenses").json()["items"]

    until(lambda: len(lenses()) == before + 3)
    newest = [server.api("GET", f"/lenses/{it['id']}").json() for it in lenses()[:3]]
    assert {it["lens"]["focal_px"] for it in newest} == {350, 351, 352}


def test_a_field_that_a_file_lacks_is_selected_and_the_file_read_again(server, page, camera):
    """The corners of a config.yml, over a field that is chosen when it is asked for."""
    config = {
        "cam_id": 1,
        "camera": {"driver": "OPENCV", "width": 1280, "height": 960},
        "geometry": {
            "camera_amount": 2,
            "line_corners": [[100, 850], [90, 80], [1180, 90], [1190, 870]],
        },
    }
    start(page, server)
    page.get_by_test_id("import-file").set_input_files(
        file_of("config.yml", json.dumps(config).encode())
    )
    again = page.get_by_test_id("import-choice")
    expect(again).to_have_text(t("versions.import.read-again"), timeout=LONG_MS)
    page.get_by_test_id("import-field").select_option("ssl-div-b")
    again.click()
    expect(page.get_by_test_id("imported")).to_contain_text("config.yml", timeout=LONG_MS)
    newest = server.api("GET", "/calibrations?limit=1").json()["items"][0]
    assert (newest["region"], newest["model"]["name"]) == ("half-right", "homography")


NUMBERS = {"fx": 400, "fy": 396, "cx": 322, "cy": 238, "D": [0.05, 0.012, -0.004, 0.0006]}
SIZED = {**NUMBERS, "width": 640, "height": 480}


@pytest.fixture
def bars(server, camera):
    """A picture of straight bars, by the fisheye of the numbers."""
    lens = Intrinsics("fisheye", (*NUMBERS["D"],), 400, 0.99, (322, 238), ImageSize(640, 480))
    sent = {"file": encoded("png", bars_behind(lens))}
    kept = server.api("POST", "/snapshots", files=sent, data={"camera": camera})
    assert kept.status_code == 201, kept.text


def choose_file(page, numbers):
    page.get_by_test_id("import-file").set_input_files(
        file_of("lens.json", json.dumps(numbers).encode())
    )


def expect_pictures(page, *, drawn):
    """One above each button, 320 px wide, and not the same."""
    pictures = page.locator(f"[data-testid=lens-picture][data-drawn={drawn}]")
    expect(pictures).to_have_count(2, timeout=LONG_MS)
    for picture in pictures.all():
        expect(picture).to_have_js_property("naturalWidth", 320)
    first, second = (picture.bounding_box() for picture in pictures.all())
    assert first["width"] == second["width"] == 320 and first["y"] == second["y"]
    said = "versions.import.lens-drawings" if drawn == "true" else "versions.import.lens-images"
    expect(page.get_by_test_id("import-refusal")).to_contain_text(like(said, camera="Importing"))


def test_two_lenses_are_told_apart_by_their_pictures(server, page, bars, camera, tmp_path):
    """Drawings first; then what each makes of the image of the camera, once it is selected."""
    start(page, server)
    choose_file(page, SIZED)
    expect(page.get_by_test_id("import-refusal")).to_contain_text("109°", timeout=LONG_MS)
    expect_pictures(page, drawn="true")
    page.screenshot(path=tmp_path / "drawn.png")
    page.get_by_test_id("import-camera").select_option(camera)
    expect_pictures(page, drawn="false")
    page.screenshot(path=tmp_path / "corrected.png")
    page.get_by_test_id("import-choice").get_by_text(t("versions.import.lens.fisheye")).click()
    expect(page.get_by_test_id("imported")).to_be_visible(timeout=LONG_MS)
    newest = server.api("GET", "/lenses").json()["items"][0]
    assert (newest["model"], newest["camera"]) == ("fisheye", camera)


def test_a_size_that_the_file_lacks_is_that_of_the_camera_s_image(server, page, bars, camera):
    start(page, server)
    choose_file(page, NUMBERS)
    again = t("versions.import.read-again")
    choices = page.get_by_test_id("import-choice")
    expect(choices).to_have_text([again], timeout=LONG_MS)
    page.get_by_test_id("import-camera").select_option(camera)
    choices.click()
    size = t("versions.import.size-of-image", width=640, height=480, camera="Importing")
    expect(choices).to_have_text([size, again], timeout=LONG_MS)
    choices.first.click()
    expect_pictures(page, drawn="false")
    choices.first.click()
    expect(page.get_by_test_id("imported")).to_be_visible(timeout=LONG_MS)
    newest = server.api("GET", "/lenses").json()["items"][0]
    assert (newest["model"], newest["image_size"]) == ("brown-conrady", [640, 480])


@pytest.mark.parametrize("camera", ["importing-live"], indirect=True)
def test_a_camera_without_a_picture_shows_its_live_one(server, page, camera):
    start(page, server)
    page.get_by_text(t("versions.import.beside")).click()
    page.get_by_test_id("import-camera").select_option(camera)
    choose_file(page, {**SIZED, "width": 320, "height": 256, "cx": 160, "cy": 128})
    expect_pictures(page, drawn="false")
    assert server.api("GET", f"/snapshots?camera={camera}").json()["items"] == []
    choose_file(page, SIZED)  # of another shape
    expect_pictures(page, drawn="true")


@pytest.mark.long
def test_a_file_that_is_dropped_is_kept_and_one_that_is_none_says_what_to_do(
    exported, server, page, tmp_path
):
    data = exported("json")
    start(page, server)
    drop(page, "cal.json", data.decode())
    expect(page.get_by_test_id("imported")).to_contain_text(
        like("versions.import.imported"), timeout=LONG_MS
    )
    drop(page, "broken.json", '{"format": "nonsense"')
    expect(page.get_by_test_id("import-refusal")).to_contain_text("broken.json: ", timeout=LONG_MS)
    expect(page.get_by_test_id("imported")).to_have_count(0)
    expect(page.get_by_test_id("notice").filter(has_text="broken.json: ")).to_be_in_viewport()
    page.screenshot(path=tmp_path / "refused.png")
    record = json.loads(data)
    page.get_by_test_id("import-file").set_input_files(
        file_of("other.json", json.dumps({**record, "corrected_size": [100, 100]}).encode())
    )
    expect(page.get_by_test_id("import-refusal")).to_contain_text("do not match", timeout=LONG_MS)


def drop(page, name, text):
    """Once the page listens: it then keeps the browser from opening the file itself."""
    until(
        lambda: page.evaluate(
            """([name, text]) => {
      const data = new DataTransfer();
      data.items.add(new File([text], name, { type: "application/json" }));
      return dispatchEvent(new DragEvent("drop", { dataTransfer: data, bubbles: true, cancelable: true }));
    }""",
            [name, text],
        ),
        lambda is_left_to_browser: not is_left_to_browser,
    )


def test_a_version_is_turned_by_keyboard_and_a_file_on_its_way_in(
    exported, server, page, camera, tmp_path
):
    """180° at a version; and the same file again, turned back: it is the version it began with."""
    start(page, server)
    page.get_by_text(t("versions.import.beside")).click()
    page.get_by_test_id("import-camera").select_option(camera)
    choice = page.get_by_test_id("import-turn")
    expect(choice.locator("option").first).to_have_text(t("versions.import.not-turned"))
    choice.select_option("180")
    page.screenshot(path=tmp_path / "import.png")
    page.get_by_test_id("import-file").set_input_files(file_of("north.json", exported("json")))
    expect(page.get_by_test_id("imported")).to_contain_text("turned by 180°", timeout=LONG_MS)
    kept = server.api("GET", f"/calibrations?camera={camera}").json()["items"][0]

    page.goto(f"{server.url}/#/cameras/{camera}/versions")
    card = page.locator(f"[data-testid=shelf-version][data-version='{kept['version']}']")
    summary = card.get_by_test_id("turn").locator("summary")
    summary.focus()
    page.keyboard.press("Enter")
    page.keyboard.press("Tab")
    expect(card.get_by_test_id("turn-90")).to_be_focused()
    page.keyboard.press("Tab")
    page.screenshot(path=tmp_path / "turn.png")
    page.keyboard.press("Enter")
    number = kept["version"] + 1
    turned = t("versions.turned", version=number, former=kept["version"])
    expect(page.get_by_text(turned)).to_be_visible(timeout=LONG_MS)
    expect(page.locator(f"[data-version='{number}']")).to_have_attribute("data-active", "false")
    page.screenshot(path=tmp_path / "turned.png")
    made = server.api("GET", f"/calibrations?camera={camera}").json()["items"][0]
    assert (made["version"], made["parent"]) == (number, kept["id"])
    body = {"from": "image", "to": "field", "points": [[390.0, 290.0], [100.0, 100.0]]}
    back = {**body, "points": [[389.0, 289.0], [679.0, 479.0]]}
    places = [
        server.api("POST", f"/calibrations/{it['id']}/transform", json=sent).json()["points"]
        for it, sent in ((kept, body), (made, back))
    ]
    assert places[1][0] == pytest.approx(places[0][0]) and places[1][1] == pytest.approx(
        places[0][1]
    )
