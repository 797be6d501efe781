"""SQLite files from strangers, opened so that a small one cannot keep the reader busy for long.

Views, virtual tables and computed columns run whatever their author wrote; trees of pages may be cyclic.
"""

from __future__ import annotations

import sqlite3
from pathlib import Path
from typing import Final
from urllib.parse import quote

LARGEST_CELL_BYTES: Final = 64 * 1024 * 1024
#: Steps of SQLite's virtual machine: a row of a bag takes some ten, and at least thirty bytes of the file.
_STEPS_PER_BYTE: Final = 50
_FEWEST_STEPS: Final = 10_000_000
_CALLED_EVERY: Final = 10_000


def bytes_of(path: Path) -> int:
    """Return the size of a file and of what has been written ahead of it."""
    ahead = path.with_name(f"{path.name}-wal")
    return path.stat().st_size + (ahead.stat().st_size if ahead.is_file() else 0)


def open_limited(path: Path) -> sqlite3.Connection:
    """Open a file for reading; statements on it end with `sqlite3.OperationalError` when they run for too long.

    Raises:
        sqlite3.Error: It cannot be opened.
    """
    database = sqlite3.connect(f"file:{quote(str(path.absolute()))}?mode=ro", uri=True, timeout=1.0)
    database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LARGEST_CELL_BYTES)
    remaining = _FEWEST_STEPS + _STEPS_PER_BYTE * bytes_of(path)

    def spent() -> bool:
        nonlocal remaining
        remaining -= _CALLED_EVERY
        return remaining < 0

    database.set_progress_handler(spent, _CALLED_EVERY)
    database.execute("PRAGMA trusted_schema = OFF")
    return database


def plain_tables(database: sqlite3.Connection) -> set[str]:
    """Return the names of plain tables: no views, virtual tables or computed columns."""
    rows = database.execute("SELECT name, sql FROM sqlite_master WHERE type = 'table'").fetchall()
    ordinary = [str(name) for name, sql in rows if not str(sql).upper().lstrip().startswith("CREATE VIRTUAL")]
    computed = "SELECT COUNT(*) FROM pragma_table_xinfo(?) WHERE hidden != 0"
    return {name for name in ordinary if not database.execute(computed, (name,)).fetchone()[0]}
