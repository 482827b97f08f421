"""Rolls: straight tracks of a ball before a live camera."""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"


def upgrade() -> None:
    sequence = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
    op.create_table("rolls", sa.Column("sequence", sequence, primary_key=True, autoincrement=True),
                    sa.Column("id", sa.String(16), nullable=False, unique=True),
                    sa.Column("camera", sa.String(64), nullable=False), sa.Column("body", sa.Text(), nullable=False),
                    sa.Column("sha256", sa.String(64), nullable=False), sa.Column("damaged", sa.Text()),
                    sqlite_autoincrement=True)
    op.create_index("ix_rolls_camera", "rolls", ["camera"])
