"""The table of models: sorted as one likes, in plain words, the recommended one marked and explained."""

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.waiting import until
from tests.support.words import t

LEVELS = {
    "good": t("common.level.good"),
    "fair": t("common.level.fair"),
    "poor": t("common.level.poor"),
    "unknown": t("calibrate.levels.unknown"),
}


@pytest.fixture
def ranked(clicked):
    operator = clicked("division", height_mm={"value": 3000.0, "sigma": 30.0}).open_lens()
    expect(operator.page.get_by_test_id("ranking")).to_be_visible(timeout=LONG_MS)
    return operator


def column(page, number):
    table = page.get_by_test_id("models")
    cells = table.locator(f"tbody > tr:first-child > td:nth-of-type({number})").all_inner_texts()
    return [
        float(text.split()[0].replace("\u202f", ""))
        for text in cells
        if text.strip() not in ("", "–")
    ]


@pytest.mark.long
def test_a_click_on_a_heading_sorts_and_another_turns_it_round(ranked, tmp_path):
    page = ranked.page
    assert column(page, 1) == sorted(column(page, 1))  # by error inside the field, unasked
    for name, number in (("field_mm", 1), ("parameters", 2)):
        head = page.get_by_test_id(f"sort-{name}")
        if name != "field_mm":
            head.click()
        expect(head.locator("xpath=..")).to_have_attribute("aria-sort", "ascending")
        assert column(page, number) == sorted(column(page, number))
        head.focus()
        page.keyboard.press("Enter")
        expect(head.locator("xpath=..")).to_have_attribute("aria-sort", "descending")
        assert column(page, number) == sorted(column(page, number), reverse=True)
    page.get_by_test_id("sort-title").click()
    expect(page.get_by_test_id("sort-title").locator("xpath=..")).to_have_attribute(
        "aria-sort", "ascending"
    )
    names = [
        text.strip("●○ \n")
        for text in page.get_by_test_id("models").locator("tbody th").all_inner_texts()
    ]
    assert names == sorted(names, key=str.casefold)
    page.screenshot(path=tmp_path / "by-name.png")


@pytest.mark.long
def test_every_models_worth_stands_in_the_servers_figures_and_in_a_plain_word(ranked):
    page, server = ranked.page, ranked.server
    draft = ranked.draft()
    body = {key: draft[key] for key in ("field", "region", "observations")}
    asked = server.api(
        "POST",
        "/calibrations/compare?job=true",
        json={
            **body,
            "snapshot": ranked.snapshot,
            "model": "division",
            "options": draft["options"],
        },
    ).json()
    told = until(
        lambda: server.api("GET", f"/jobs/{asked['id']}").json(),
        lambda job: job["state"] == "done",
        LONG_MS / 1000,
    )["result"]
    assert told["recommended"] is not None
    for row in told["ranking"]:
        shown = page.locator(f'[data-row="{row["model"]}"]')
        expect(shown).to_contain_text(LEVELS[row["verdict"]["level"]])
        error = row["field_mm"]
        expect(shown.locator("td").first).to_contain_text(
            f"{error:.0f}" if error >= 10 else f"{error:.1f}"
        )
        is_marked = t("calibrate.model-table.recommended") in shown.inner_text()
        assert is_marked == (row["model"] == told["recommended"])
    expect(page.get_by_test_id("ranking")).to_contain_text(
        t("calibrate.model-table.recommended-model")
    )
