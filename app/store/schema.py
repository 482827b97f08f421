"""Which form the tables have, and bringing them to the newest; a database of a newer Touchline is refused.

Each step is one transaction: a kill leaves the old form or the new one.
"""

from pathlib import Path

from sqlalchemy import Engine, inspect, text

from app.core.errors import Unavailable

HEAD = "0004"
MIGRATIONS = Path(__file__).parent / "migrations"


def schema_of(engine: Engine) -> str | None:
    """The step that a database has reached; None for one without our tables."""
    with engine.connect() as connection:
        if not inspect(connection).has_table("alembic_version"):
            return None
        return connection.scalar(text("SELECT version_num FROM alembic_version"))


def check_not_newer(schema: str | None) -> None:
    """Refuse what only a newer Touchline understands."""
    if schema is not None and schema > HEAD:  # names of steps are numbers of four digits
        raise Unavailable(f"The database was made by a newer Touchline (form {schema}; this one knows {HEAD}).",
                          "Start the newer one, or restore an archive or backup from before the update into an empty "
                          "folder.", reason="newer-database")


def upgrade(engine: Engine) -> None:
    """Run every missing step."""
    from alembic import command  # takes a fifth of a second, and only new databases need it
    from alembic.config import Config

    config = Config()
    config.set_main_option("script_location", str(MIGRATIONS).replace("%", "%%"))
    config.set_main_option("path_separator", "os")
    with engine.begin() as connection:
        config.attributes["connection"] = connection
        command.upgrade(config, "head")
