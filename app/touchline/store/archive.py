"""Everything in a data folder as one zip, and back to an empty folder; a restore that was cut short is never opened.

    touchline.json        {"format", "form": step of the schema that its tables have, "software", "made_at"}
    tables/NAME.jsonl     every row, a JSON object a line; the same from SQLite and from PostgreSQL
    pictures/SHA256.EXT   the pictures, as they were sent
    fields/NAME.yaml      the operator's own fields
    end.json              {"rows": {table: how many}, "pictures", "missing": [pictures that were lost before]}

The rows of cameras have their passwords in clear where that was asked for, and else none.
end.json comes last: an archive without it was cut short and is refused. What is read back is checked: each row and
each picture by its own checksum.
"""

import json
import re
import shutil
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping, Set
from contextlib import ExitStack, closing
from hashlib import sha256
from pathlib import Path
from types import SimpleNamespace
from typing import IO, Any

from sqlalchemy import insert, select, text
from sqlalchemy.orm import Session

from touchline.core.errors import BadInput, Conflict, NotFound, TouchlineError, Unavailable
from touchline.installation import __version__
from touchline.store.database import Database
from touchline.store.files import make_folder, sync_folder, write_atomically
from touchline.store.integrity import is_intact
from touchline.store.lock import FolderLock
from touchline.store.opening import FILE, create_sqlite, open_postgresql
from touchline.store.quarantine import Quarantine
from touchline.store.repository import Clock, timestamp
from touchline.store.tables import ARCHIVED_TABLES, CameraRow, Checksummed

FORMAT = "touchline-archive-1"
FORM = "0004"  # the step of the schema that last changed a table in it
PICTURE = re.compile(r"[0-9a-f]{64}\.(png|jpeg|bmp|webp)")
FIELD = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}\.yaml")
CHUNK = 1 << 20
MAX_HEAD_BYTES = 1 << 20
MAX_ROW_BYTES = 64 << 20  # the largest rows are jobs with everything that they found, some MB
MAX_FILE_BYTES = 256 << 20  # no picture that is taken in is larger
FIX = "Use another archive. This archive cannot be restored."
UNFINISHED = "restore-unfinished"  # while it is there, the folder is not opened


def archive_pieces(
    database: Database,
    folder: Path,
    fields: Path | None,
    clock: Clock,
    archived_camera: Callable[[dict[str, Any]], dict[str, Any]],
) -> Iterator[bytes]:
    """Return the zip piece by piece: one consistent state of the database, however slowly it is read.

    The rows are read before the first piece, so that what cannot be read is no archive that ends in the middle.
    """
    with database.failures.noted("The archive"), ExitStack() as undo:
        tables = undo.enter_context(tempfile.TemporaryFile(dir=folder))
        pieces = _pieces(
            tables, *_copy_tables(database, tables, archived_camera), folder, fields, clock
        )
        undo.pop_all()
    return pieces


def _pieces(
    tables: IO[bytes],
    rows: Mapping[str, int],
    pictures: Set[str],
    folder: Path,
    fields: Path | None,
    clock: Clock,
) -> Iterator[bytes]:
    pipe = _Pipe()
    with tables, zipfile.ZipFile(pipe, "w", zipfile.ZIP_DEFLATED) as out:
        out.writestr(
            "touchline.json",
            json.dumps(
                {
                    "format": FORMAT,
                    "form": FORM,
                    "software": __version__,
                    "made_at": timestamp(clock),
                }
            ),
        )
        tables.seek(0)
        for name, count in rows.items():
            with out.open(f"tables/{name}.jsonl", "w", force_zip64=True) as member:
                for _ in range(count):
                    member.write(tables.readline())
                    yield from pipe.take(CHUNK)
        missing = []
        for name in sorted(pictures):
            path = folder / "pictures" / name
            try:
                data = path.read_bytes()
            except OSError:
                missing.append(name)
                continue
            # pictures do not get smaller: stored
            out.writestr(zipfile.ZipInfo(f"pictures/{name}"), data)
            yield from pipe.take(CHUNK)
        for path in sorted(fields.glob("*.yaml")) if fields is not None and fields.is_dir() else ():
            out.write(path, f"fields/{path.name}")
        out.writestr(
            "end.json",
            json.dumps(
                {"rows": rows, "pictures": len(pictures) - len(missing), "missing": missing}
            ),
        )
    yield from pipe.take(1)


def _copy_tables(
    database: Database,
    out: IO[bytes],
    archived_camera: Callable[[dict[str, Any]], dict[str, Any]],
) -> tuple[dict[str, int], set[str]]:
    counts: dict[str, int] = {}
    pictures: set[str] = set()
    with database.reading() as rows:
        if not database.is_sqlite:
            rows.connection(execution_options={"isolation_level": "REPEATABLE READ"})
        for table in ARCHIVED_TABLES:
            columns = list(table.__table__.columns)
            counts[table.__tablename__] = 0
            every = select(*columns).order_by(*table.__mapper__.primary_key)
            for row in rows.execute(every.execution_options(yield_per=500)):
                values = {
                    column.name: getattr(row, column.key, row[number])
                    for number, column in enumerate(columns)
                }
                if table is CameraRow:
                    values = archived_camera(values)
                out.write(json.dumps(values).encode("ascii") + b"\n")
                counts[table.__tablename__] += 1
                if picture := values.get("picture"):
                    pictures.add(picture)
    return counts, pictures


def restore_archive(file: Path, database: Database, folder: Path) -> dict[str, int]:
    """Fill an empty database and folder from an archive; return how many rows each table has.

    A refused archive leaves the database empty, and perhaps files in the folder.
    """
    try:
        with zipfile.ZipFile(file) as source:
            _check_head(source)
            for name in source.namelist():
                _restore_file(source, name, folder)
            with database.writing("The archive") as rows:
                counts = _restore_tables(source, rows, database.is_sqlite)
                if counts != json.loads(_read(source, "end.json", MAX_HEAD_BYTES))["rows"]:
                    raise BadInput(
                        "The archive is incomplete: rows are missing.", FIX, reason="bad-archive"
                    )
            return counts
    except (
        zipfile.BadZipFile,
        zlib.error,
        KeyError,
        TypeError,
        ValueError,
        EOFError,
        NotImplementedError,
        RecursionError,
    ) as error:
        raise BadInput(
            f"{file.name} is not a complete Touchline archive: {error}.", FIX, reason="bad-archive"
        ) from None


def _read(source: zipfile.ZipFile, name: str, max_bytes: int) -> bytes:
    """Return a member that is no larger, whatever it says of itself."""
    with source.open(name) as member:
        return _bounded(member.read(max_bytes + 1), name, max_bytes)


def _bounded(data: bytes, name: str, max_bytes: int) -> bytes:
    if len(data) > max_bytes:
        raise BadInput(
            f"{name} in the archive is larger than {max_bytes >> 20} MiB.",
            FIX,
            reason="bad-archive",
        )
    return data


def _check_head(source: zipfile.ZipFile) -> None:
    head = json.loads(_read(source, "touchline.json", MAX_HEAD_BYTES))
    if head["format"] != FORMAT:
        raise BadInput(
            f"The archive has the format {head['format']!r}, not {FORMAT}.",
            FIX,
            reason="bad-archive",
        )
    if head["form"] != FORM:
        raise Conflict(
            f"The archive has the table format {head['form']}; this Touchline supports {FORM}.",
            f"Restore it with Touchline {head['software']}, then update.",
            reason="archive-form",
        )


def _restore_tables(source: zipfile.ZipFile, rows: Session, is_sqlite: bool) -> dict[str, int]:
    counts: dict[str, int] = {}
    for table in ARCHIVED_TABLES:
        name, counts[table.__tablename__] = table.__tablename__, 0
        keys = {column.name: column.key for column in table.__table__.columns}
        with source.open(f"tables/{name}.jsonl") as lines:
            while line := _bounded(lines.readline(MAX_ROW_BYTES + 1), name, MAX_ROW_BYTES):
                values = {keys[name]: value for name, value in json.loads(line).items()}
                _check_row(table, values)
                rows.execute(insert(table.metadata.tables[name]).values(values))
                counts[name] += 1
        if not is_sqlite and "sequence" in keys:
            rows.execute(
                text(
                    f"SELECT setval(pg_get_serial_sequence('{name}', 'sequence'), "
                    f"greatest(1, (SELECT coalesce(max(sequence), 1) FROM {name})))"
                )
            )
    return counts


def _check_row(table: Any, values: Mapping[str, Any]) -> None:
    if (
        issubclass(table, Checksummed)
        and values["damaged"] is None
        and not is_intact(SimpleNamespace(**values), table)
    ):
        raise BadInput(
            f"A row of {table.__tablename__} in the archive is damaged.", FIX, reason="bad-archive"
        )


def _restore_file(source: zipfile.ZipFile, name: str, folder: Path) -> None:
    """Write one picture or field; anything else is skipped, and nothing is written outside the folder."""
    kind, _, file = name.partition("/")
    if kind == "pictures" and PICTURE.fullmatch(file):
        data = _read(source, name, MAX_FILE_BYTES)
        if sha256(data).hexdigest() != file[:64]:
            raise BadInput(
                f"The image {file} in the archive is damaged.", FIX, reason="bad-archive"
            )
        write_atomically(make_folder(folder / kind) / file, data)
    elif kind == "fields" and FIELD.fullmatch(file):
        write_atomically(make_folder(folder / kind) / file, _read(source, name, MAX_HEAD_BYTES))


class _Pipe:
    """A file that is only written forwards, and from which the bytes are taken as they come."""

    def __init__(self) -> None:
        self._pieces: list[bytes] = []
        self._size = 0

    def write(self, data: bytes) -> int:
        self._pieces.append(bytes(data))
        self._size += len(data)
        return len(data)

    def flush(self) -> None:
        pass

    def close(self) -> None:
        pass

    def take(self, min_bytes: int) -> Iterator[bytes]:
        """Yield what was written, if it is at least so many bytes."""
        if self._size >= min_bytes:
            whole = b"".join(self._pieces)
            self._pieces, self._size = [], 0
            yield whole


def restore_into(file: Path, folder: Path, database: str | None) -> dict[str, int]:
    """Restore the archive and count the rows of each table; Conflict if the folder or the database is not empty."""
    if not file.is_file():
        raise NotFound(
            f"The file {file} does not exist.",
            "Choose a zip file from archive or GET /archive.",
            reason="no-archive",
        )
    if folder.is_dir() and any(folder.iterdir()):
        raise Conflict(
            f"The folder {folder} is not empty.",
            "Choose an empty or a new folder. Existing data is never overwritten.",
            reason="folder-not-empty",
        )
    is_new = not folder.is_dir()
    make_folder(folder)
    with closing(FolderLock(folder)):
        (folder / UNFINISHED).touch()
        sync_folder(folder)
        try:
            counts = _fill(file, folder, database)
        except TouchlineError:
            _remove_all(folder, is_new)
            raise
        make_folder(folder / "pictures")
        (folder / UNFINISHED).unlink()
        sync_folder(folder)
        return counts


def _remove_all(folder: Path, itself: bool) -> None:
    """Leave it as it was found, empty or missing; what says that it is not whole goes last."""
    for path in sorted(folder.iterdir(), key=lambda path: path.name == UNFINISHED):
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    if itself:
        folder.rmdir()


def refuse_unfinished(folder: Path) -> None:
    """Raise Unavailable for a folder in which a restore was cut short."""
    if (folder / UNFINISHED).exists():
        raise Unavailable(
            f"The folder {folder} is from an incomplete restore.",
            "Delete that folder and restore the archive again.",
            reason="restore-unfinished",
        )


def _fill(file: Path, folder: Path, setting: str | None) -> dict[str, int]:
    if setting is None:
        path = folder / FILE
        create_sqlite(path)
        with closing(Database.on_sqlite(path)) as database:
            return restore_archive(file, database, folder)
    database, lock = open_postgresql(setting, folder, Quarantine(folder / "quarantine"), {})
    with closing(database), closing(lock):
        if database.changes() != 0:
            raise Conflict(
                "The database is not empty.",
                "Enter a new database in the settings. Existing data is never overwritten.",
                reason="database-not-empty",
            )
        return restore_archive(file, database, folder)
