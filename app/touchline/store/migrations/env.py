"""What Alembic runs: every missing step, on the connection that opening.py gives it."""

from alembic import context

from touchline.store.tables import Base

context.configure(connection=context.config.attributes["connection"], target_metadata=Base.metadata)
with context.begin_transaction():
    context.run_migrations()
