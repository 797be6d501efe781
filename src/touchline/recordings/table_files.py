"""Writers of tables of recorded messages as CSV and Parquet."""

import csv
import json
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from touchline.recordings.table_columns import JSON_FORM, TableColumn, TableRows
from touchline.recordings.writing import replacing

if TYPE_CHECKING:
    import pyarrow as pa

_TIMES = ("time [s]", "log_time [s]", "topic")
#: Rows of a Parquet row group.
_AT_ONCE = 20_000


def write_csv(table: TableRows, path: Path) -> int:
    """Write RFC 4180 with a header line, lists as JSON, None as nothing; return the number of rows.

    Raises:
        SpecError: The file cannot be written.
    """
    count = 0
    with replacing(path) as part, part.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow([*_TIMES, *(column.name for column in table.columns)])
        for row in table.rows():
            writer.writerow([json.dumps(cell) if isinstance(cell, list) else cell for cell in row])
            count += 1
    return count


def write_parquet(table: TableRows, path: Path) -> int:
    """Write Parquet, each column with its unit in its metadata; return the number of rows.

    Raises:
        SpecError: The file cannot be written.
    """
    import pyarrow as pa
    from pyarrow import parquet

    schema = pa.schema([*_time_fields(), *map(_field, table.columns)])
    count = 0
    with replacing(path) as part, parquet.ParquetWriter(part, schema) as writer:
        rows = table.rows()
        while batch := list(islice(rows, _AT_ONCE)):
            columns = [_array(cells, field.type) for cells, field in zip(zip(*batch, strict=True), schema, strict=True)]
            writer.write_table(pa.table(columns, schema=schema))
            count += len(batch)
    return count


def _array(cells: tuple[object, ...], form: Any) -> Any:
    import pyarrow as pa

    if pa.types.is_string(form):
        cells = tuple(cell if cell is None or isinstance(cell, str) else json.dumps(cell) for cell in cells)
    return pa.array(cells, form)


def _time_fields() -> "Iterator[pa.Field]":
    import pyarrow as pa

    for name in _TIMES[:2]:
        yield pa.field(name, pa.float64(), metadata={"unit": "s"})
    yield pa.field(_TIMES[2], pa.string())


def _field(column: TableColumn) -> "pa.Field":
    import pyarrow as pa

    numbers = {"bool": "bool_", "byte": "uint8", "octet": "uint8", "char": "uint8", "float": "float32"}
    name = numbers.get(column.form, column.form)
    text = column.form in (JSON_FORM, "string", "wstring") or not hasattr(pa, name)
    form = pa.string() if text else getattr(pa, name)()
    listed = pa.list_(form) if column.listed else form
    return pa.field(column.name, listed, metadata={"unit": column.unit} if column.unit else None)
