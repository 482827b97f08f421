"""Files for other programs, by the page: every format with what it holds and what the version loses in it."""

import pytest
import yaml
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.manual_pictures import manual_picture
from tests.support.words import t
from touchline.formats import FORMATS

ELSEWHERE = {"json", "npz"}  # offered to everybody


def test_every_format_is_offered_with_what_it_costs_and_can_be_had(saved, server):
    operator = saved("brown-conrady")
    page, it = operator.unfold("export").page, operator.saved()
    menu = page.get_by_test_id("exports")
    menu.locator("summary").click()
    for name in FORMATS:
        expect(page.get_by_test_id(f"export-{name}")).to_have_count(0 if name in ELSEWHERE else 1)
    told = {
        f["format"]: f
        for f in server.api("GET", f"/calibrations/{it['id']}/exports").json()["items"]
    }
    for name in set(FORMATS) - ELSEWHERE:
        worst = None if told[name]["loss"] is None else told[name]["loss"]["worst_mm"]
        shown = t("versions.export.exact") if worst is None else f"{worst:.2f} mm"
        expect(page.get_by_test_id(f"cost-{name}")).to_contain_text(shown)
    assert (
        told["opencv"]["exact"]
        and not told["ssl-vision"]["exact"]
        and told["ssl-vision"]["loss"]["worst_mm"] > 0.01
    )
    menu.scroll_into_view_if_needed()
    expect(page.get_by_test_id("corrected")).to_be_visible(timeout=LONG_MS)
    manual_picture(page, "formats")
    with page.expect_download() as coming:
        page.get_by_test_id("export-opencv").click()
    value = yaml.safe_load(coming.value.path().read_text())
    assert value["camera_matrix"]["data"][0] == it["model"]["parameters"]["focal_px"]
    assert coming.value.suggested_filename.endswith(".yml")
    with page.expect_download() as coming:
        page.get_by_test_id("export-ssl-vision").click()
    assert (
        coming.value.suggested_filename.endswith(".pb")
        and coming.value.path().read_bytes()[:1] == b"\x12"
    )


@pytest.mark.long
def test_another_version_is_asked_anew(clicked):
    operator = clicked("polynomial").next("verify").unfold("export")
    page = operator.page
    page.get_by_test_id("exports").locator("summary").click()
    # no lens holds the paper's method
    expect(page.get_by_test_id("cost-opencv")).to_contain_text("mm")
    expect(page.get_by_test_id("cost-csv")).to_have_text(t("versions.export.exact"))
