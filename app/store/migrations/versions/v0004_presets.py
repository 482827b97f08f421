"""Presets: colour profiles by name, and what each camera is to see."""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"


def upgrade() -> None:
    op.create_table("presets", sa.Column("key", sa.String(80), primary_key=True),
                    sa.Column("body", sa.Text(), nullable=False), sa.Column("sha256", sa.String(64), nullable=False),
                    sa.Column("damaged", sa.Text()))
