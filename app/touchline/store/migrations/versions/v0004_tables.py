"""All tables, as tables.py has them.

The steps 0001 to 0003 led here before the first release; the oldest database that anybody may have is of step 0004.
"""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = None

SEQUENCE = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    _sequenced(
        "snapshots",
        sa.Column("picture", sa.String(80), nullable=False),
        sa.Column("purpose", sa.String(40), nullable=False),
    )
    op.create_index("ix_snapshots_picture", "snapshots", ["picture"])
    op.create_index("ix_snapshots_purpose", "snapshots", ["purpose"])
    _table(
        "drafts",
        sa.Column("snapshot", sa.String(16), sa.ForeignKey("snapshots.id"), primary_key=True),
        sa.Column("revision", sa.Integer(), nullable=False),
        sa.Column("is_begun", sa.Boolean(), nullable=False),
    )
    _sequenced(
        "calibrations",
        sa.Column("camera_key", sa.String(12), nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("parent", sa.Text()),
        sa.Column("snapshot", sa.Text()),
        sa.Column("software", sa.Text(), nullable=False),
        sa.Column("created_at", sa.Text(), nullable=False),
        sa.Column("made_by", sa.Text(), nullable=False),
        sa.Column("deleted_at", sa.Text()),
        sa.UniqueConstraint("camera_key", "version"),
    )
    op.create_index("ix_calibrations_camera", "calibrations", ["camera_key", "sequence"])
    op.create_index("ix_calibrations_snapshot", "calibrations", ["snapshot"])
    _table(
        "active",
        sa.Column("camera_key", sa.String(12), primary_key=True),
        sa.Column("calibration", sa.String(16), sa.ForeignKey("calibrations.id"), nullable=False),
    )
    op.create_table(
        "activations",
        _sequence(),
        sa.Column("camera_key", sa.String(12), nullable=False),
        sa.Column("calibration", sa.String(16), sa.ForeignKey("calibrations.id"), nullable=False),
        sa.Column("at", sa.Text(), nullable=False),
        sa.Column("made_by", sa.Text(), nullable=False),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_activations_camera_key", "activations", ["camera_key"])
    _sequenced("lenses")
    _table(
        "cameras",
        sa.Column("id", sa.String(64), primary_key=True),
        sa.Column("revision", sa.Integer(), nullable=False),
        sa.Column("place", sa.Integer(), nullable=False),
    )
    _table("identities", sa.Column("camera", sa.String(64), primary_key=True))
    _table(
        "rigs",
        sa.Column("name", sa.String(64), primary_key=True),
        sa.Column("place", sa.Integer(), nullable=False),
    )
    _sequenced("rolls", sa.Column("camera", sa.String(64), nullable=False))
    op.create_index("ix_rolls_camera", "rolls", ["camera"])
    _table("presets", sa.Column("key", sa.String(80), primary_key=True))
    op.create_table(
        "jobs",
        _sequence(),
        sa.Column("id", sa.String(16), nullable=False, unique=True),
        sa.Column("kind", sa.Text(), nullable=False),
        sa.Column("state", sa.String(12), nullable=False),
        sa.Column("spec", sa.Text(), nullable=False),
        sa.Column("attempt", sa.Integer(), nullable=False),
        sa.Column("worker", sa.Text()),
        sa.Column("watch", sa.String(16)),
        sa.Column("lease_until", sa.Double()),
        sa.Column("heartbeat", sa.Double()),
        sa.Column("progress", sa.Double(), nullable=False),
        sa.Column("message", sa.Text(), nullable=False),
        sa.Column("result", sa.Text()),
        sa.Column("problem", sa.Text()),
        sa.Column("created_at", sa.Text(), nullable=False),
        sa.Column("ended_at", sa.Text()),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_jobs_state", "jobs", ["state", "sequence"])
    ledger = op.create_table(
        "ledger",
        sa.Column("one", sa.Integer(), primary_key=True, autoincrement=False),
        sa.Column("changes", SEQUENCE, nullable=False),
    )
    op.bulk_insert(ledger, [{"one": 1, "changes": 0}])


def _sequenced(name: str, *columns: sa.schema.SchemaItem) -> None:
    _table(
        name,
        _sequence(),
        sa.Column("id", sa.String(16), nullable=False, unique=True),
        *columns,
        sqlite_autoincrement=True,
    )


def _table(name: str, *columns: sa.schema.SchemaItem, **options: bool) -> None:
    op.create_table(
        name,
        *columns,
        sa.Column("body", sa.Text(), nullable=False),
        sa.Column("sha256", sa.String(64), nullable=False),
        sa.Column("damaged", sa.Text()),
        **options,
    )


def _sequence() -> sa.Column[int]:
    return sa.Column("sequence", SEQUENCE, primary_key=True, autoincrement=True)
