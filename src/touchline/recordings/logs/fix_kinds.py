"""Kinds of fixes in tables: words as receivers' programs write them, or numbers of NMEA or MAVLink."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final

import numpy as np

from touchline.recordings.logs.csv_columns import plain_name
from touchline.recordings.logs.log_table import Floats
from touchline.schemas.log_mapping import FIX_KINDS

FIX_KIND: Final = "fix_kind"
"""Column of the kinds, as in `GnssStatus`."""
_NONE, _SINGLE, _FLOAT, _FIXED = range(len(FIX_KINDS))
_WORDS: Final = {
    _NONE: "invalid none nofix nosolution unavailable",
    _SINGLE: "single autonomous gps spp dgps dgnss differential sbas 2d 3d 2dfix 3dfix",
    _FLOAT: "float rtkfloat floatrtk narrowfloat",
    _FIXED: "fixed rtkfixed rtkfix fixedrtk narrowint",
}
_KIND_OF: Final = {word: kind for kind, words in _WORDS.items() for word in words.split()}
_NMEA: Final = {1: _SINGLE, 2: _SINGLE, 3: _SINGLE, 4: _FIXED, 5: _FLOAT}
_MAVLINK: Final = {2: _SINGLE, 3: _SINGLE, 4: _SINGLE, 5: _FLOAT, 6: _FIXED}
_NUMBERS: Final[Mapping[str, Mapping[int, int]]] = {
    **dict.fromkeys(
        ("quality", "fix_quality", "gps_quality", "gga_quality", "quality_indicator"), MappingProxyType(_NMEA)
    ),
    **dict.fromkeys(("fix_type", "gps_fix_type"), MappingProxyType(_MAVLINK)),
}
_ONLY_WORDS: Final = ("fix", "fix_status", "gps_fix", "carrier", "rtk", "rtk_status", "solution", "solution_type")
"""Usual names of columns whose words alone have one meaning; those of `_NUMBERS` have numbers with one, too."""


def kind_columns(names: Sequence[str]) -> list[str]:
    """Return the columns that may have the kinds of fixes."""
    return [name for name in names if plain_name(name)[0] in (*_NUMBERS, *_ONLY_WORDS)]


def kinds_of(name: str, cells: Sequence[str], numbers: Floats) -> Floats | None:
    """Return (n,) kinds; NaN where a cell has none; None if the column does not say.

    Args:
        name: The column.
        cells: (n,) its texts.
        numbers: (n,) its numbers; NaN where a text is none.
    """
    by_number = _NUMBERS.get(plain_name(name)[0])
    if np.isfinite(numbers).any():
        if by_number is None:
            return None
        return np.array([float(by_number.get(int(each), _NONE)) for each in np.nan_to_num(numbers).clip(0, 99)])
    found = np.array([float(_KIND_OF.get(re.sub(r"[^a-z0-9]", "", cell.lower()), np.nan)) for cell in cells])
    return found if np.isfinite(found).any() else None
