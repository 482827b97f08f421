"""The database behind the store: SQLite in the data folder, or PostgreSQL; one writer, any number of readers.

    with database.writing("The draft") as rows: …     saved when the block ends, whole; or not at all, with an error
    with database.reading() as rows: …                one consistent view

SQLite: write-ahead log, every commit flushed before it is acknowledged (synchronous=FULL), one connection that
writes. (SQLite before 3.51.3 can damage a database into which two connections write at the same moment.)
"""

import errno
import json
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from pathlib import Path
from threading import RLock
from typing import Any, Self

from sqlalchemy import URL, Engine, create_engine, event, func, make_url, select, text, update
from sqlalchemy.exc import ArgumentError, DBAPIError, OperationalError
from sqlalchemy.exc import TimeoutError as NoConnection
from sqlalchemy.orm import Session

from touchline.core.errors import BadInput, Busy, DiskFull, TouchlineError, Unavailable
from touchline.core.sentences import REPEAT, TRY_AGAIN, install_package
from touchline.core.statements import join, say
from touchline.store.files import (
    CHECK_DISK,
    DAMAGED,
    DISK_IS_FULL,
    FREE_SPACE,
    RecentFailures,
    because,
    not_saved,
    write_atomically,
)
from touchline.store.tables import ARCHIVED_TABLES, LedgerRow

READERS = 8  # connections that read; more callers wait for one
BUSY_MS = 5000
# PostgreSQL's name for the lock of a transaction that writes; any number that nobody else takes
WRITE_KEY = 0x70C42
SCHEMA_KEY = "hashtext(current_schema())"
FULL_SQLSTATES = ("53100", "53200")  # disk full, out of memory
DAMAGED_CODES = (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB)


def count_rows(rows: Session) -> dict[str, int]:
    """Count the rows of each table, by its name."""
    counts = [
        select(func.count()).select_from(table).scalar_subquery() for table in ARCHIVED_TABLES
    ]
    return dict(
        zip(
            (table.__tablename__ for table in ARCHIVED_TABLES),
            rows.execute(select(*counts)).one(),
            strict=True,
        )
    )


def count_missing_rows(rows: Session) -> dict[str, int]:
    """Count by table the rows that are gone since something was saved last; only tables that lack some."""
    counts = rows.scalar(select(LedgerRow.counts))
    saved: dict[str, int] = json.loads(counts) if counts else {}
    return {
        name: saved[name] - count
        for name, count in count_rows(rows).items()
        if saved.get(name, 0) > count
    }


class Database:
    """Thread-safe. url: of SQLite or PostgreSQL; folder: the data folder, on whose disk a full one is noticed."""

    def __init__(self, url: URL, folder: Path) -> None:
        self.url = url
        self.is_sqlite = url.get_backend_name() == "sqlite"
        self._folder = folder
        self._lock = RLock()
        self._open: Session | None = None  # the transaction of the thread that has the lock
        self._failed = False  # whether a part of it failed
        self._changes: int | None = None  # how many it has saved; None until somebody has asked
        self._is_closing = False  # then it may be damaged: its file is about to be replaced
        self.failures = RecentFailures()
        self.on_commit: Callable[[], None] = lambda: None
        # raises where another server saves
        self.check_owner: Callable[[Session], None] = lambda rows: None
        if self.is_sqlite:
            self._writer = self._sqlite(1)
            self._reader = self._sqlite(READERS, "query_only=ON")
        else:
            self._writer = self._reader = postgresql_engine(url, READERS)

    @classmethod
    def on_sqlite(cls, path: Path) -> Self:
        """Open the database in a file."""
        return cls(URL.create("sqlite", database=str(path)), path.parent)

    def changes(self) -> int:
        """Return how many changes it has saved; of one that was damaged since it was opened as well."""
        if self._changes is None:
            with self.reading() as rows:
                self._changes = rows.scalar(select(LedgerRow.changes)) or 0
        return self._changes

    @property
    def engine(self) -> Engine:
        """Return the engine that may write: for migrations and start-up."""
        return self._writer

    @contextmanager
    def writing(self, what: str) -> Iterator[Session]:
        """Open a transaction that is saved at the end of the block. what: how an error calls it, such as "The draft".

        On return it survives a power cut. DiskFull or Unavailable where it was not saved. Within another such block of
        the same thread it is a part of that one: saved when that one ends.
        """
        with self._lock, self._translated_errors(what):
            if self._open is None:
                yield from self._committed()
                return
            try:
                yield self._open
            except BaseException:
                # whoever catches it in between: half a transaction is never saved
                self._failed = True
                raise

    def _committed(self) -> Iterator[Session]:
        with Session(self._writer) as rows:
            self._open, self._failed = rows, False
            try:
                if not self.is_sqlite:  # SQLite's BEGIN IMMEDIATE does the same
                    rows.execute(text(f"SELECT pg_advisory_xact_lock({WRITE_KEY}, {SCHEMA_KEY})"))
                self.check_owner(rows)
                yield rows
                if self._failed:
                    raise Unavailable(
                        say(
                            "database.part-not-saved",
                            "Nothing was saved, because a part of it could not be saved.",
                        ),
                        REPEAT,
                        reason="not-saved",
                    )
                changes = rows.scalar(
                    update(LedgerRow)
                    .values(changes=LedgerRow.changes + 1, counts=json.dumps(count_rows(rows)))
                    .returning(LedgerRow.changes)
                )
                rows.commit()
                self._changes = changes
                self.on_commit()
            except (DBAPIError, TouchlineError) as error:
                if isinstance(error, DBAPIError) or isinstance(error.__cause__, DBAPIError):
                    # after a failed write a connection of SQLite is not to be trusted
                    rows.invalidate()
                raise
            finally:
                self._open = None

    @contextmanager
    def reading(self) -> Iterator[Session]:
        """Open a consistent view; Unavailable where the database does not answer."""
        with self._translated_errors(None), Session(self._reader) as rows:
            yield rows

    @contextmanager
    def closed(self) -> Iterator[int]:
        """Close SQLite while the block replaces its file; yield its number of changes.

        Its log is a part of the file then, unless the file is damaged: the log is beside it in that case.
        Whoever reads or saves meanwhile waits for the end of the block, and goes on with the file that is there then.
        """
        with self._lock, self._translated_errors(None), ExitStack() as undo:
            changes = self.changes()
            self._is_closing = True
            undo.callback(setattr, self, "_is_closing", False)
            for engine, count in ((self._reader, READERS), (self._writer, 1)):
                for _ in range(count):
                    held = engine.raw_connection()
                    undo.callback(held.invalidate)  # whoever has it next opens the file anew
                    connection: Any = held.driver_connection
                    if engine is self._writer and _cannot_empty_log(connection):
                        raise Busy(
                            say("database.in-use", "Another program has the database open."),
                            TRY_AGAIN,
                        )
                    connection.close()
            yield changes
            self._changes = None
            self.failures.forget()

    def close(self) -> None:
        """Readers first: the last connection that closes empties the log, and that must be the writer."""
        self._reader.dispose()
        self._writer.dispose()

    @contextmanager
    def _translated_errors(self, what: str | None) -> Iterator[None]:
        try:
            yield
        except (DBAPIError, sqlite3.Error) as error:
            refusal = self._error(what, error)
            self.failures.note(refusal)
            raise refusal from error
        except NoConnection:
            raise Busy(
                say("database.overloaded", "The database is overloaded."), TRY_AGAIN
            ) from None

    def _error(self, what: str | None, error: Exception) -> TouchlineError:
        done = not_saved(what) if what else say("database.cannot-read", "The data cannot be read:")
        cause = getattr(error, "orig", error)
        code = getattr(cause, "sqlite_errorcode", None)
        if code is not None and code & 0xFF in DAMAGED_CODES:
            return Unavailable(
                join(done, say("database.is-damaged", "the database is damaged.")),
                say(
                    "database.restore",
                    "Restore the newest good backup, under System, Server. If that "
                    "does not help, restart Touchline: it moves the damaged database to quarantine and "
                    "restores the newest backup.",
                ),
                reason=DAMAGED,
            )
        if self._is_full(cause, code):
            return DiskFull(join(done, DISK_IS_FULL), FREE_SPACE)
        if self.is_sqlite:
            return Unavailable(join(done, because(str(cause))), CHECK_DISK, reason="not-saved")
        if isinstance(error, OperationalError):
            return Unavailable(
                join(done, say("database.is-silent", "the database is not responding.")),
                say(
                    "database.check-postgresql",
                    "Check that PostgreSQL is running and can be reached, then try again.",
                ),
                reason="database-away",
            )
        raise error  # a mistake of ours: the log shall have all of it

    def _is_full(self, cause: Any, code: int | None) -> bool:
        if code is None:
            return getattr(cause, "sqlstate", None) in FULL_SQLSTATES
        if code & 0xFF == sqlite3.SQLITE_FULL:
            return True
        # a quota's refusal comes as this
        return code & 0xFF == sqlite3.SQLITE_IOERR and is_full(self._folder)

    def _sqlite(self, connections: int, *more: str) -> Engine:
        engine = create_engine(
            self.url,
            pool_size=connections,
            max_overflow=0,
            pool_timeout=30,
            connect_args={"check_same_thread": False, "cached_statements": 64},
        )
        pragmas = (
            "journal_mode=WAL",
            "synchronous=FULL",
            "foreign_keys=ON",
            f"busy_timeout={BUSY_MS}",
            # what was deleted is overwritten: it may have had a password
            "secure_delete=ON",
            *more,
        )

        @event.listens_for(engine, "connect")
        def _set(connection: Any, _: Any) -> None:
            connection.isolation_level = None  # Python shall not begin transactions for us
            connection.text_factory = _text
            with suppress(sqlite3.DatabaseError) if self._is_closing else nullcontext():
                for pragma in pragmas:
                    connection.execute(f"PRAGMA {pragma}")

        @event.listens_for(engine, "begin")
        def _begin(connection: Any) -> None:
            connection.exec_driver_sql("BEGIN" if more else "BEGIN IMMEDIATE")

        return engine


def is_full(folder: Path) -> bool:
    """Check whether not even a small file can be written there."""
    probe = folder / ".space"
    try:
        write_atomically(probe, bytes(65536))
        probe.unlink()
    except OSError as error:
        return error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
    return False


def postgresql_url(setting: str) -> URL:
    """The setting `database`, checked; its password is in no message."""
    fix = "Write it as postgresql+psycopg://USER:PASSWORD@HOST/DATABASE, or omit it for SQLite."
    try:
        url = make_url(setting)
    except (ArgumentError, ValueError):
        raise BadInput(
            "The setting `database` is not the address of a database.", fix, reason="bad-settings"
        ) from None
    if url.get_backend_name() != "postgresql":
        raise BadInput(
            f"The setting `database` names {url.get_backend_name()}, which is not supported.",
            fix,
            reason="bad-settings",
        )
    return url.set(drivername="postgresql+psycopg")


def _cannot_empty_log(connection: Any) -> bool:
    """Try to make the log a part of the file; whether another program is in the way. A damaged file keeps its log."""
    with suppress(sqlite3.DatabaseError):
        return bool(connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()[0])
    return False


def _text(raw: bytes) -> str:
    """Decode damaged text as well, so that its checksum can be compared."""
    return raw.decode("utf-8", "surrogateescape")


def postgresql_engine(url: URL, connections: int) -> Engine:
    """Return an engine of so many connections to PostgreSQL; BadInput without its driver."""
    try:
        engine = create_engine(
            url,
            pool_size=connections,
            max_overflow=0,
            pool_pre_ping=True,
            connect_args={"connect_timeout": 5},
        )
    except ModuleNotFoundError:
        raise BadInput(
            "The setting `database` names PostgreSQL, but the driver is not installed.",
            install_package("psycopg[binary]"),
            reason="bad-settings",
        ) from None

    @event.listens_for(engine, "connect")
    def _set(connection: Any, _: Any) -> None:
        # acknowledged is saved, whatever the server's default is
        connection.execute("SET synchronous_commit = on")
        connection.commit()

    return engine
