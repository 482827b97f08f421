"""Rolls of a ball: kept once each, left out and taken in again, brought along by the archive, on either database."""

import pytest

from tests.support.store_opener import damage_row
from touchline.core.errors import NotFound
from touchline.store.archive import restore_into
from touchline.store.tables import RollRow
from touchline.straight import service
from touchline.straight.service import RollRepository

ROLL = {"points": [[1.5, 2.25], [30.0, 40.0]], "seconds": 0.5, "image_size": [640, 480]}


@pytest.fixture
def store(opener, tmp_path):
    with opener(tmp_path / "data") as opened:
        yield opened


@pytest.fixture
def rolls(store):
    return store.repository(RollRepository)


def test_a_roll_that_two_pages_have_seen_is_kept_once_and_survives_a_restart(opener, store, rolls):
    assert [rolls.add("north", f"{n:016x}", ROLL) for n in (1, 2, 1)] == [True, True, False]
    rolls.add("south", f"{3:016x}", ROLL)
    store.close()
    with opener(store.folder) as again:
        kept = again.repository(RollRepository).of("north")
        assert [roll["id"] for roll in kept] == [f"{1:016x}", f"{2:016x}"]
        assert (
            kept[0]["points"] == ROLL["points"]
            and not kept[0]["left_out"]
            and kept[0]["camera"] == "north"
        )


def test_a_roll_is_left_out_taken_in_again_and_removed(rolls):
    ids = [f"{n:016x}" for n in (1, 2)]
    for id in ids:
        rolls.add("north", id, ROLL)
    before = rolls.revision
    assert rolls.leave_out("north", ids[0], True)["left_out"] and rolls.of("north")[0]["left_out"]
    assert not rolls.leave_out("north", ids[0], False)["left_out"]
    rolls.delete("north", ids[0])
    assert [roll["id"] for roll in rolls.of("north")] == ids[1:] and rolls.revision == before + 3
    rolls.clear("north")
    assert rolls.of("north") == ()


def test_what_is_not_there_or_another_cameras_is_said_to_be_unknown(rolls):
    rolls.add("north", f"{1:016x}", ROLL)
    for camera, id in (
        ("north", f"{2:016x}"),
        ("south", f"{1:016x}"),
        ("north", "none"),
        ("north", "\0"),
    ):
        for deed in (
            lambda camera=camera, id=id: rolls.leave_out(camera, id, True),
            lambda camera=camera, id=id: rolls.delete(camera, id),
        ):
            with pytest.raises(NotFound) as refused:
                deed()
            assert refused.value.reason == "unknown-roll"
    assert len(rolls.of("north")) == 1


def test_the_newest_are_kept_where_there_are_too_many(rolls, monkeypatch):
    monkeypatch.setattr(service, "MAX_ROLLS", 3)
    for number in range(5):
        rolls.add("north", f"{number:016x}", ROLL)
    rolls.add("south", f"{9:016x}", ROLL)
    assert [roll["id"] for roll in rolls.of("north")] == [f"{n:016x}" for n in (2, 3, 4)]


def test_a_damaged_roll_hides_no_other(store, rolls):
    for number in (1, 2):
        rolls.add("north", f"{number:016x}", ROLL)
    damage_row(store, RollRow, lambda text: "{}", id=f"{1:016x}")
    assert [roll["id"] for roll in rolls.of("north")] == [f"{2:016x}"]
    assert store.damaged


def test_the_archive_brings_rolls_along(store, rolls, opener, tmp_path):
    rolls.add("north", f"{1:016x}", ROLL)
    path, bare = tmp_path / "all.zip", tmp_path / "bare"
    path.write_bytes(b"".join(store.archive()))
    assert restore_into(path, bare, opener.address(bare))["rolls"] == 1
    with opener(bare) as again:
        assert again.repository(RollRepository).of("north") == rolls.of("north")
