"""The tables that the migrations make are those that the code expects, on both databases."""

from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory

from touchline.store.opening import HEAD, MIGRATIONS
from touchline.store.tables import Base


def test_the_migrations_end_with_the_tables_that_the_code_expects(opener, tmp_path):
    with opener(tmp_path / "data") as store, store._database.engine.connect() as connection:
        assert compare_metadata(MigrationContext.configure(connection), Base.metadata) == []


def test_the_last_step_is_the_form_that_a_database_is_refused_beyond():
    assert ScriptDirectory(str(MIGRATIONS)).get_current_head() == HEAD
