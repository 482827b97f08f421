"""How many rows each table has, and had when something was saved last: rows that vanished since are missed."""

import json

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from touchline.store.tables import ARCHIVED_TABLES, LedgerRow


def count_rows(rows: Session) -> dict[str, int]:
    """Count the rows of each table, by its name."""
    counts = [select(func.count()).select_from(table).scalar_subquery() for table in ARCHIVED_TABLES]
    return dict(zip((table.__tablename__ for table in ARCHIVED_TABLES), rows.execute(select(*counts)).one(),
                    strict=True))


def count_missing_rows(rows: Session) -> dict[str, int]:
    """Count by table the rows that are gone since something was saved last; only tables that lack some."""
    counts = rows.scalar(select(LedgerRow.counts))
    saved: dict[str, int] = json.loads(counts) if counts else {}
    return {name: saved[name] - count for name, count in count_rows(rows).items() if saved.get(name, 0) > count}
