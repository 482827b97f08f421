"""An activation keeps the claims that it was made in spite of."""

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"


def upgrade() -> None:
    op.add_column("activations", sa.Column("despite", sa.Text()))
