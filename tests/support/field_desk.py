"""What an operator does at the field editor, and what the server then has."""

import re

from playwright.sync_api import Page, expect

# from straight above no picture tells the height
OBLIQUE = "?size=640x512&fps=5&robots=0&tilt=15&lens=mild"


def field_of(desk, name: str) -> dict:
    return desk.api("GET", f"/fields/{name}").json()


def named(entries: list[dict]) -> dict[str, dict]:
    return {entry["name"]: entry for entry in entries}


def fill(page: Page, entry: str, text: object) -> None:
    box = page.get_by_test_id(f"entry-{entry}")
    box.fill(str(text))
    box.press("Enter")


def save(page: Page, name: str) -> None:
    """By the bright button, and until the server has it."""
    with page.expect_response(lambda answer: answer.request.method == "PUT") as saved:
        page.get_by_test_id("next").click()
    assert saved.value.ok, saved.value.text()
    expect(page).to_have_url(re.compile(rf"#/field/fields/{name}$"))


def copy(page: Page, desk, name: str) -> None:
    page.goto(f"{desk.url}/#/field/new-field/{name}")
    expect(page.get_by_test_id("field-editor")).to_be_visible()


def centre_of(page: Page, grip: str) -> tuple[float, float]:
    box = page.get_by_test_id(grip).first.bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def camera_of(desk, id: str) -> dict:
    return next(c for c in desk.api("GET", "/cameras").json()["items"] if c["id"] == id)


def calibrate_without_clicks(operator, field: str, source: str, id: str) -> None:
    """Add a camera over a field, and activate what detection makes of its picture, all by the bright button."""
    page, desk = operator.page, operator.server
    desk.api(
        "POST",
        "/cameras",
        json={
            "id": id,
            "name": f"The {id} camera",
            "field": field,
            "region": "full",
            "source": source,
        },
    )
    operator.prefer("detect", "on")
    page.goto("about:blank")  # the preference is read when the page is loaded
    page.goto(f"{desk.url}/#/cameras")
    page.get_by_test_id(f"camera-{id}").click()
    expect(page.get_by_test_id("lines-found")).to_be_visible()
    operator.next("verify")
    operator.activate(warned=False)
