"""Lenses that are known already: held by a camera's fit, fast or as well as they are known."""

import pytest
from playwright.sync_api import expect

from tests.support.words import t


def test_the_lens_of_an_earlier_calibration_is_held_and_stays_held(clicked, saved, tmp_path):
    earlier = saved("brown-conrady", height_mm={"value": 3000.0, "sigma": 30.0}).saved()
    other = saved("division").saved()
    operator = clicked("brown-conrady").open_lens()
    page, choice = operator.page, operator.page.get_by_test_id("option-lens")
    expect(choice.locator(f"option[value='{earlier['id']}']")).to_be_attached()
    # another model's lens
    expect(choice.locator(f"option[value='{other['id']}']")).to_have_count(0)
    choice.select_option(earlier["id"])
    expect(page.get_by_test_id("option-lens_sigma")).to_have_value("0")
    assert operator.draft()["options"] == {"lens": earlier["id"], "lens_sigma": "0"}
    choice.scroll_into_view_if_needed()
    page.screenshot(path=tmp_path / "held.png")
    operator.next("verify")
    made = operator.saved()
    for name in ("focal_px", "lens_terms", "centre_px"):
        assert made["model"]["parameters"][name] == pytest.approx(
            earlier["model"]["parameters"][name], rel=1e-9
        ), name
    page.reload()
    expect(page.get_by_test_id("sentence")).to_contain_text(
        t("shell.sentence.version-inactive", version=made["version"])
    )
    expect(page.get_by_test_id("changed")).to_have_count(0)
