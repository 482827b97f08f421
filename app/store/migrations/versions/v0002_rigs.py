"""Rigs: cameras that share a field."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"


def upgrade() -> None:
    op.create_table("rigs", sa.Column("name", sa.String(64), primary_key=True),
                    sa.Column("place", sa.Integer(), nullable=False), sa.Column("body", sa.Text(), nullable=False),
                    sa.Column("sha256", sa.String(64), nullable=False), sa.Column("damaged", sa.Text()))
