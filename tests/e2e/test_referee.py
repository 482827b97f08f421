"""Robot heights on the page: what the game controller says, what an operator enters, and the table."""

from playwright.sync_api import expect

from tests.support.group_listener import free_group, said
from tests.support.manual_pictures import manual_picture
from tests.support.referee_messages import referee
from tests.support.waiting import until
from tests.support.words import t


def test_an_operator_sees_the_teams_that_play_enters_one_and_changes_the_table(page, own_server):
    way = {name: value for name, value in free_group().items() if name != "ttl"}
    own_server.api("PUT", "/referee", json={"enabled": True, **way})

    def heard():
        said(referee(blue="ibis", yellow="Ours"), **way)
        return own_server.api("GET", "/referee").json()["teams"]["blue"]["team"]

    until(heard)
    page.goto(f"{own_server.url}/#/system/publishing")
    blue, yellow = (page.get_by_test_id(f"height-of-{team}") for team in ("blue", "yellow"))
    expect(blue).to_contain_text("ibis")
    expect(blue).to_contain_text(t("referee.used.mm", height=90))
    expect(blue).to_contain_text(t("referee.used.by-game-controller"))
    expect(yellow).to_contain_text(t("referee.used.unknown", team="Ours"))

    page.get_by_test_id("team-yellow").select_option("TIGERs Mannheim")
    expect(yellow).to_contain_text(t("referee.used.mm", height=143))
    expect(yellow).to_contain_text(t("referee.used.by-hand"))
    page.set_viewport_size({"width": 1280, "height": 900})
    manual_picture(page.get_by_test_id("robot-heights"), "robot-heights")

    page.get_by_test_id("height-yellow").fill("141.5")
    page.get_by_test_id("height-yellow").press("Tab")
    expect(yellow).to_contain_text(t("referee.used.mm", height=141.5))
    page.get_by_test_id("height-yellow").fill("")
    page.get_by_test_id("height-yellow").press("Tab")
    page.get_by_test_id("team-yellow").select_option("")
    expect(yellow).to_contain_text(t("referee.used.unknown", team="Ours"))

    page.get_by_test_id("heights-table").press("Enter")
    page.get_by_test_id("new-team").fill("Ours")
    page.get_by_test_id("new-height").fill("120")
    page.get_by_test_id("new-height").press("Enter")
    expect(yellow).to_contain_text(t("referee.used.mm", height=120))
    row = page.get_by_test_id("height-row").filter(has_text="Ours")
    row.get_by_role("button").press("Enter")
    expect(row).to_have_count(0)
    file = {"name": "robot-heights.yml", "mimeType": "text/plain", "buffer": b"Ours: 130\n"}
    page.get_by_test_id("heights-file").set_input_files(file)
    expect(yellow).to_contain_text(t("referee.used.mm", height=130))
