"""Options of ``touchline export`` for tables of topics."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from touchline.cli.display import say
from touchline.schemas.errors import SpecError
from touchline.schemas.optional_packages import require


@dataclass(frozen=True)
class TableChoice:
    """Topics and files of tables."""

    topics: Annotated[
        list[str] | None, typer.Option("--topic", metavar="TOPIC", help="Topic to write as a table; may be repeated.")
    ] = None
    csv: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the topics to this CSV file.")] = None
    parquet: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the topics to this Parquet file.")] = None

    def __post_init__(self) -> None:
        """Refuse a format whose package is missing.

        Raises:
            TouchlineError: Its package is not installed.
        """
        if self.parquet is not None:
            require("pyarrow", "--parquet")

    @property
    def asked(self) -> bool:
        """True if there is a table to write."""
        return self.csv is not None or self.parquet is not None or bool(self.topics)

    def write(self, recording: Path, written: dict[str, int]) -> str:
        """Write the tables and add the number of rows to ``written``; return what is missing, empty if nothing.

        Raises:
            SpecError: No topic is given, or no file.
        """
        from touchline.recordings.table_columns import table_of
        from touchline.recordings.table_files import write_csv, write_parquet

        if not self.topics:
            raise SpecError("command line", "--topic", "is missing", "name a topic; `touchline info` lists them")
        if self.csv is None and self.parquet is None:
            raise SpecError("command line", "--csv", "is missing", "give --csv or --parquet")
        table = table_of(recording, self.topics)
        for path, write in ((self.csv, write_csv), (self.parquet, write_parquet)):
            if path is not None:
                written["rows"] = write(table, path)
                say(f"{written['rows']:,} rows in {path}")
        damaged = f"{table.damaged:,} messages cannot be decoded" if table.damaged else ""
        return "; ".join(filter(None, (damaged, table.problem)))
