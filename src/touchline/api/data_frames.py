"""Tables for the user: of pandas or polars where one is installed, else structured arrays of NumPy."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.errors import SpecError
from touchline.schemas.optional_packages import require

Kind = Literal["auto", "pandas", "polars", "numpy"]
PACKAGES = ("pandas", "polars")


def as_frame(table: NDArray[np.void], kind: Kind = "auto") -> Any:
    """A structured array as a frame, a column for each field; arrays in a field become one column each.

    Args:
        table: (n,) structured array.
        kind: Package to use; "auto": pandas, else polars, else the array itself.

    Raises:
        SpecError: There is no such kind.
        TouchlineError: The package is not installed.
    """
    if kind not in ("auto", *PACKAGES, "numpy"):
        raise SpecError("frame", "kind", f"is {kind!r}", "give auto, pandas, polars or numpy")
    if kind == "auto":
        found: str = next((name for name in PACKAGES if find_spec(name) is not None), "numpy")
    else:
        found = kind
    if found == "numpy":
        return table
    require(found, f'frame(kind="{found}")')
    if found == "pandas":
        import pandas as pd

        return pd.DataFrame(_columns(table))
    import polars as pl

    return pl.DataFrame(_columns(table))


def _columns(table: NDArray[np.void]) -> dict[str, NDArray[Any]]:
    columns: dict[str, NDArray[Any]] = {}
    for name in table.dtype.names or ():
        column = table[name]
        if column.ndim == 1:
            columns[name] = np.ascontiguousarray(column)
        else:
            columns |= {f"{name}[{i}]": np.ascontiguousarray(column[:, i]) for i in range(column.shape[1])}
    return columns
