"""A lock for one server a data folder or database: two would overwrite each other's work without noticing.

PostgreSQL's advisory lock ends with its connection, so that a restart of PostgreSQL takes it from a server that lives
on. Hence two things more: a thread takes the lock back within a second, and the ledger names the server that saves.
Each transaction that writes reads that name: a server in whose place another has come saves nothing any more.
"""

import fcntl
import logging
import os
from contextlib import suppress
from pathlib import Path
from threading import Event, Lock, Thread
from time import monotonic, sleep

from sqlalchemy import Connection, select, text, update
from sqlalchemy.exc import DBAPIError, SQLAlchemyError
from sqlalchemy.orm import Session

from touchline.core.errors import Unavailable
from touchline.core.records import Warning
from touchline.core.statements import say
from touchline.store.database import SCHEMA_KEY, WRITE_KEY, Database, postgresql_engine
from touchline.store.repository import new_id
from touchline.store.tables import LedgerRow

log = logging.getLogger("touchline")
LOCK = "lock"
ADVISORY_KEY = 0x70C41  # any number that nobody else is likely to take
WAIT_S = 5.0  # PostgreSQL may take a moment to notice that a killed server has gone
KEEP_S = 1.0  # how often the lock is looked at
GRACE_S = 3.0  # for a server that did not sign off: it may live, and take its lock back
TAKEN = "The database is in use by another Touchline"
LOST = say(
    "database.lost", "The database is in use by another Touchline. This server saves nothing."
)
RESTART = say("database.stop-one", "Stop one of them, then restart this server.")


class FolderLock:
    """Locked until close(), or until the process ends, however it does."""

    def __init__(self, folder: Path) -> None:
        self._handle = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
        try:
            fcntl.flock(self._handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            owner = os.read(self._handle, 20).decode("ascii", "replace").strip()
            os.close(self._handle)
            raise Unavailable(
                f"The data folder {folder} is in use by another Touchline (process "
                f"{owner or 'unknown'}).",
                "Stop that process, or choose another folder with --data. If it is a server, "
                "touchline call --server URL makes calls to it.",
                reason="data-folder-in-use",
            ) from None
        os.ftruncate(self._handle, 0)
        os.pwrite(self._handle, f"{os.getpid()}\n".encode(), 0)

    def is_in(self, folder: Path) -> bool:
        """Tell whether it is still that folder's: somebody may have moved or deleted the folder."""
        with suppress(OSError):
            return os.path.samestat(os.fstat(self._handle), os.stat(folder / LOCK))
        return False

    def close(self) -> None:
        if self._handle >= 0:
            os.close(self._handle)
            self._handle = -1


class PostgresLock:
    """Held until close(), or until another server has claimed the database. Thread-safe."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self._engine = postgresql_engine(database.url, 1)
        self._owner = new_id()
        self._mutex = Lock()
        self._lost = False
        self._connection: Connection | None = None
        self._ended = Event()
        self._thread = Thread(target=self._keep, name="database lock", daemon=True)
        try:
            self._wait_for_lock()
        except BaseException:
            self.close()
            raise

    def claim(self) -> None:
        """Enter this server in the ledger, and watch from now on; Unavailable where the one before still lives."""
        with self._database.reading() as rows:
            former = rows.scalar(select(LedgerRow.owner))
        if former is not None:
            self._release()
            sleep(GRACE_S)
            self._wait_for_lock()
        self._enter(former, self._owner)
        self._database.check_owner = self._check
        self._thread.start()

    def warnings(self) -> tuple[Warning, ...]:
        """Return what an operator should know: that another server has the database."""
        return (Warning("read-only", LOST, RESTART),) if self._lost else ()

    def close(self) -> None:
        """Sign off and release the lock."""
        self._ended.set()
        if self._thread.is_alive():
            self._thread.join()
            with suppress(DBAPIError):
                self._enter(self._owner, None)
        self._release()
        self._engine.dispose()

    def _check(self, rows: Session) -> None:
        """Raise Unavailable where another server has the database. rows: the transaction that is about to save."""
        if rows.scalar(select(LedgerRow.owner)) != self._owner:
            self._lose()
            raise Unavailable(LOST, RESTART, reason="read-only")

    def _keep(self) -> None:
        while not self._ended.wait(KEEP_S):
            with suppress(DBAPIError):  # PostgreSQL is away: whoever reads or saves is told
                self._renew()

    def _renew(self) -> None:
        """Take the lock back if its connection has ended, unless another server was there meanwhile."""
        with self._mutex:
            if self._lost or self._is_connected():
                return
            self._release()
            connection = self._lock()
            if connection is not None and connection.scalar(select(LedgerRow.owner)) == self._owner:
                return
            self._lose()
            self._release()

    def _lose(self) -> None:
        if not self._lost:
            log.error(LOST)
        self._lost = True

    def _is_connected(self) -> bool:
        try:
            return self._connection is not None and self._connection.scalar(text("SELECT 1")) == 1
        except DBAPIError:
            return False

    def _lock(self) -> Connection | None:
        """Open a connection that holds the lock; None where another one does."""
        connection = self._engine.connect().execution_options(isolation_level="AUTOCOMMIT")
        connection.detach()  # from its pool: it ends when it is closed
        if connection.scalar(text(f"SELECT pg_try_advisory_lock({ADVISORY_KEY}, {SCHEMA_KEY})")):
            self._connection = connection
            return connection
        connection.close()
        return None

    def _wait_for_lock(self) -> None:
        until = monotonic() + WAIT_S
        while self._lock() is None:
            if monotonic() > until:
                raise Unavailable(
                    f"{TAKEN}.",
                    "Stop that server, or enter another database in the settings.",
                    reason="data-folder-in-use",
                )
            sleep(0.1)

    def _release(self) -> None:
        if self._connection is not None:
            with suppress(SQLAlchemyError):
                self._connection.close()
            self._connection = None

    def _enter(self, former: str | None, owner: str | None) -> None:
        """Name the server that saves from now on, between two transactions that do."""
        with self._database.engine.begin() as connection:
            connection.execute(text(f"SELECT pg_advisory_xact_lock({WRITE_KEY}, {SCHEMA_KEY})"))
            connection.execute(
                update(LedgerRow)
                .where(LedgerRow.owner.is_not_distinct_from(former))
                .values(owner=owner)
            )
