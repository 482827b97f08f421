"""Opening stores in tests, on either database, and damaging what they hold behind their back."""

import sqlite3
from contextlib import closing
from pathlib import Path

from sqlalchemy import select, update

from tests.support.store_writer import calibration
from touchline.core.records import Calibration
from touchline.store import database
from touchline.store.opening import FILE
from touchline.store.store import Store
from touchline.store.tables import CalibrationRow


class StoreOpener:
    """Opens stores on SQLite, or on the given PostgreSQL server with a database for each folder."""

    def __init__(self, server=None) -> None:
        self.server = server

    @property
    def on_sqlite(self) -> bool:
        return self.server is None

    def __call__(self, folder: Path, **more) -> Store:
        return Store(folder, database=self.address(folder), **more)

    def address(self, folder: Path) -> str | None:
        """The setting `database` for that folder."""
        return None if self.server is None else self.server.database(Path(folder))

    def again(self, store: Store, **more) -> Store:
        """The same, after a restart."""
        store.close()
        return self(store.folder, **more)


def damage_row(store: Store, table, change, **key) -> None:
    """Change one row's body as a bad disk would, without its checksum. change: of a text."""
    with store._database.engine.begin() as connection:
        where = [getattr(table, name) == value for name, value in key.items()]
        body = connection.scalar(select(table.body).where(*where))
        assert body is not None, "there is no such row"
        connection.execute(update(table).where(*where).values(body=change(body)))


def break_database(store: Store, first_byte: int = 0) -> bytes:
    """Overwrite an open SQLite database from that byte on, with nothing of it in its log or in memory; return it."""
    path = store.folder / FILE
    with closing(sqlite3.connect(path)) as connection:
        assert connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()[0] == 0
    whole = path.read_bytes()
    with path.open("r+b") as file:
        file.seek(first_byte)
        file.write(b"\xa5" * (len(whole) - first_byte))
    store._database._reader.dispose()
    store._database._writer.dispose()
    broken = path.read_bytes()
    assert broken[first_byte:].strip(b"\xa5") == b""
    return broken


def damaged_folder(folder: Path) -> Calibration:
    """Fill a data folder: a good backup, a row that was damaged after it, and a save after that; return that row."""
    with Store(folder) as store:
        kept = store.calibrations.add(calibration("north", "kept"))
    with Store(folder) as store:
        damage_row(store, CalibrationRow, lambda text: text.replace("kept", "lept"), id=kept.id)
        store.calibrations.add(calibration("north", "newer"))
    return kept


def count_rows(store: Store) -> dict[str, int]:
    """How many rows each table has, whatever their state."""
    with store._database.reading() as rows:
        return database.count_rows(rows)
