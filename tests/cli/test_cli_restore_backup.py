"""touchline restore-backup on data folders that are really damaged."""

import shutil

from tests.support.store_opener import damaged_folder
from touchline.store.store import Store


def test_the_newest_backup_without_damage_is_restored_and_what_it_lacks_is_named(
    touchline, tmp_path
):
    kept = damaged_folder(tmp_path / "data")
    code, out, said = touchline("restore-backup", "--data", "data")
    assert (code, out) == (0, "") and "newer changes can only be found in replaced/" in said
    with Store(tmp_path / "data") as store:
        assert [one.note for one in store.calibrations.list().items] == ["kept"]
        assert store.calibrations.get(kept.id) == kept and not any(
            damage.restorable for damage in store.damaged
        )
    (before,) = (tmp_path / "data" / "replaced").glob("*/touchline.db")
    assert before.stat().st_size > 10_000


def test_without_a_good_backup_or_a_folder_or_beside_a_server_it_is_refused(touchline, tmp_path):
    damaged_folder(tmp_path / "data")
    with Store(tmp_path / "data"):
        code, _, said = touchline("restore-backup", "--data", "data")
        assert code == 4 and "in use by another Touchline" in said
    shutil.rmtree(tmp_path / "data" / "backups")
    code, _, said = touchline("restore-backup", "--data", "data")
    assert code == 4 and "no backup in which all data is intact" in said and "fix: " in said
    assert (
        touchline("restore-backup", "--data", "nowhere")[0] == 4
        and not (tmp_path / "nowhere").exists()
    )


def test_on_postgresql_it_names_the_backups_that_there_are(touchline, tmp_path, postgres):
    (tmp_path / "data").mkdir()
    (tmp_path / "settings.yaml").write_text(f"database: {postgres.database(tmp_path / 'data')}\n")
    code, _, said = touchline("restore-backup", "--data", "data", "--config", "settings.yaml")
    assert code == 4 and "pg_restore" in said
