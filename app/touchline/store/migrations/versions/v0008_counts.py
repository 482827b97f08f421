"""The ledger knows how many rows there are, so that those that vanish are missed; and which version could read all."""

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"


def upgrade() -> None:
    op.add_column("ledger", sa.Column("counts", sa.Text()))
    op.add_column("ledger", sa.Column("missing", sa.Text()))
    op.add_column("ledger", sa.Column("read_by", sa.Text()))
