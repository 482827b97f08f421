"""The ledger knows how many rows there are, so that rows that vanish while nobody looks are missed."""

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"


def upgrade() -> None:
    op.add_column("ledger", sa.Column("counts", sa.Text()))
    op.add_column("ledger", sa.Column("missing", sa.Text()))
