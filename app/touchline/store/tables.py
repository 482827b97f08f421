"""The tables, as SQLAlchemy sees them; migrations/ makes them, and a test holds the two together.

Every row carries its content as text, `body`; most other columns repeat what the database must find it by, and
`sha256` is the checksum of both (integrity.py). `sequence` is the order in which rows came and is
never used twice; no date orders anything. `damaged` names the quarantine's file once a row was found to be damaged.
"""

from typing import Any

from sqlalchemy import BigInteger, ForeignKey, Index, Integer, String, Text, UniqueConstraint
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

from touchline.core.jobs import State

# SQLite counts only an INTEGER primary key by itself; PostgreSQL's INTEGER would end at two thousand million.
Sequence = BigInteger().with_variant(Integer, "sqlite")


class Base(DeclarativeBase):
    pass


class Checksummed(Base):
    """Columns of all rows that carry their own checksum."""

    __abstract__ = True

    body: Mapped[str] = mapped_column(Text)
    sha256: Mapped[str] = mapped_column(String(64))
    damaged: Mapped[str | None] = mapped_column(Text)


class Sequenced(Checksummed):
    """Rows in the order in which they came."""

    __abstract__ = True

    __table_args__: tuple[Any, ...] = ({"sqlite_autoincrement": True},)

    sequence: Mapped[int] = mapped_column(Sequence, primary_key=True, autoincrement=True)
    id: Mapped[str] = mapped_column(String(16), unique=True)


class SnapshotRow(Sequenced):
    """A stored picture; its bytes are the file pictures/PICTURE."""

    __tablename__ = "snapshots"

    picture: Mapped[str] = mapped_column(String(80), index=True)
    purpose: Mapped[str] = mapped_column(String(40), index=True)


class DraftRow(Checksummed):
    """The work in progress on one snapshot."""

    __tablename__ = "drafts"

    snapshot: Mapped[str] = mapped_column(ForeignKey("snapshots.id"), primary_key=True)
    revision: Mapped[int]
    is_begun: Mapped[bool]  # whether anything was clicked: then the picture is needed


class CalibrationRow(Sequenced):
    """One version, never written again but for its deletion, which hides it and keeps its number."""

    __tablename__ = "calibrations"
    __table_args__ = (
        UniqueConstraint("camera_key", "version"),
        Index("ix_calibrations_camera", "camera_key", "sequence"),
        {"sqlite_autoincrement": True},
    )

    camera_key: Mapped[str] = mapped_column(String(12))
    version: Mapped[int]
    parent: Mapped[str | None] = mapped_column(Text)
    snapshot: Mapped[str | None] = mapped_column(Text, index=True)
    software: Mapped[str] = mapped_column(Text)
    created_at: Mapped[str] = mapped_column(Text)
    made_by: Mapped[str] = mapped_column(Text)
    deleted_at: Mapped[str | None] = mapped_column(Text)


class ActiveRow(Checksummed):
    """Which version is its camera's: one row a camera."""

    __tablename__ = "active"

    camera_key: Mapped[str] = mapped_column(String(12), primary_key=True)
    calibration: Mapped[str] = mapped_column(ForeignKey("calibrations.id"))


class ActivationRow(Base):
    """What was active when, who made it so, and despite which claims (codes, JSON): only ever added to."""

    __tablename__ = "activations"
    __table_args__ = ({"sqlite_autoincrement": True},)

    sequence: Mapped[int] = mapped_column(Sequence, primary_key=True, autoincrement=True)
    camera_key: Mapped[str] = mapped_column(String(12), index=True)
    calibration: Mapped[str] = mapped_column(ForeignKey("calibrations.id"))
    at: Mapped[str] = mapped_column(Text)
    by: Mapped[str] = mapped_column("made_by", Text)
    despite: Mapped[str | None] = mapped_column(Text)


class LensRow(Sequenced):
    """A lens from pictures of a board."""

    __tablename__ = "lenses"


class CameraRow(Checksummed):
    """A camera that an operator has added."""

    __tablename__ = "cameras"

    id: Mapped[str] = mapped_column(String(64), primary_key=True)
    revision: Mapped[int]
    place: Mapped[int]  # in the list: the order in which they were added


class IdentityRow(Checksummed):
    """Which physical camera an id was confirmed to be."""

    __tablename__ = "identities"

    camera: Mapped[str] = mapped_column(String(64), primary_key=True)


class RigRow(Checksummed):
    """Cameras that share a field."""

    __tablename__ = "rigs"

    name: Mapped[str] = mapped_column(String(64), primary_key=True)
    place: Mapped[int]  # in the list


class RollRow(Sequenced):
    """A straight roll of a ball before a live camera."""

    __tablename__ = "rolls"

    camera: Mapped[str] = mapped_column(String(64), index=True)


class PresetRow(Checksummed):
    """A colour profile by its name, or what a camera is to detect: key is "colours:NAME" or "seeing:CAMERA"."""

    __tablename__ = "presets"

    key: Mapped[str] = mapped_column(String(80), primary_key=True)


class JobRow(Base):
    """Long work: the row is the truth about it, whoever computes."""

    __tablename__ = "jobs"
    __table_args__ = (Index("ix_jobs_state", "state", "sequence"), {"sqlite_autoincrement": True})

    sequence: Mapped[int] = mapped_column(Sequence, primary_key=True, autoincrement=True)
    id: Mapped[str] = mapped_column(String(16), unique=True)
    kind: Mapped[str] = mapped_column(Text)
    state: Mapped[State] = mapped_column(String(12))
    spec: Mapped[str] = mapped_column(Text)
    attempt: Mapped[int]  # how many have begun
    worker: Mapped[str | None] = mapped_column(Text)  # these four are used no more
    watch: Mapped[str | None] = mapped_column(String(16))
    lease_until: Mapped[float | None]
    heartbeat: Mapped[float | None]
    progress: Mapped[float]
    message: Mapped[str] = mapped_column(Text)
    statements: Mapped[str | None] = mapped_column(Text)  # of the message, as JSON
    result: Mapped[str | None] = mapped_column(Text)
    problem: Mapped[str | None] = mapped_column(Text)
    created_at: Mapped[str] = mapped_column(Text)
    ended_at: Mapped[str | None] = mapped_column(Text)


class LedgerRow(Base):
    """One row: how many changes were saved. A database with fewer than its newest backup has lost some.

    owner: the server that saves, in PostgreSQL, which several could reach; null where the last one signed off.
    counts: how many rows each table had at the last save, as JSON.
    missing: the quarantine's file of rows that vanished; null where none did, or where that file was removed.
    read_by: the version of Touchline that has found every row readable, or set it aside.
    """

    __tablename__ = "ledger"

    one: Mapped[int] = mapped_column(Integer, primary_key=True)
    changes: Mapped[int] = mapped_column(Sequence)
    owner: Mapped[str | None] = mapped_column(String(16))
    counts: Mapped[str | None] = mapped_column(Text)
    missing: Mapped[str | None] = mapped_column(Text)
    read_by: Mapped[str | None] = mapped_column(Text)


# What is checked, archived and restored, in an order in which a row's references come before it.
ARCHIVED_TABLES: tuple[type[Base], ...] = (
    SnapshotRow,
    DraftRow,
    CalibrationRow,
    ActiveRow,
    ActivationRow,
    LensRow,
    CameraRow,
    IdentityRow,
    RigRow,
    RollRow,
    PresetRow,
)
CHECKSUMMED_TABLES: tuple[type[Checksummed], ...] = tuple(
    table for table in ARCHIVED_TABLES if issubclass(table, Checksummed)
)
