"""Bring the tables to the newest schema; refuse a database of a newer Touchline.

Each step is one transaction: a kill leaves the old schema or the new one.
"""

from pathlib import Path

from alembic import command
from alembic.config import Config
from sqlalchemy import Engine, inspect, text

from touchline.core.errors import Unavailable

HEAD = "0008"
MIGRATIONS = Path(__file__).parent / "migrations"


def schema_of(engine: Engine) -> str | None:
    """Return the step that a database has reached; None for one without our tables."""
    with engine.connect() as connection:
        if not inspect(connection).has_table("alembic_version"):
            return None
        found: str | None = connection.scalar(text("SELECT version_num FROM alembic_version"))
        return found


def check_not_newer(schema: str | None) -> None:
    """Raise Unavailable for what only a newer Touchline understands."""
    if schema is not None and schema > HEAD:  # names of steps are numbers of four digits
        raise Unavailable(f"The database was made by a newer Touchline (format {schema}; this version supports "
                          f"{HEAD}).",
                          "Start the newer version, or restore an archive or backup from before the update to an "
                          "empty folder.", reason="newer-database")


def upgrade(engine: Engine) -> None:
    """Run every step that the database lacks."""
    config = Config()
    config.set_main_option("script_location", str(MIGRATIONS).replace("%", "%%"))
    config.set_main_option("path_separator", "os")
    with engine.begin() as connection:
        config.attributes["connection"] = connection
        command.upgrade(config, "head")
