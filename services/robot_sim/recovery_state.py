"""State restored after a crash: place and earlier work of a traversal; also as JSON, for recordings."""

from __future__ import annotations

import base64
import math
import zlib
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.onboard.interface import LEARNED_FIGURES, Checkpoint

_MOST_PAINT_BYTES: Final = 256 * 1024 * 1024


class Totals(NamedTuple):
    """Consumption and sums by the tick of the checkpoint."""

    supplies: tuple[float, float, float, float]
    """Supplies as in `World.supplies`."""
    errors: tuple[float, ...]
    """Sums (3,) as in `EstimatorError`."""
    points: int
    """Number of points of paint, as in `PaintLedger`."""


class EarlierWork(NamedTuple):
    """Earlier work on a traversal: the totals, and the paint."""

    totals: Totals
    paint: NDArray[np.float64]
    """Rows (n, 5) as in `PaintLedger`; fewer than `totals.points` if the rest was lost."""


def restored_json(resume: Checkpoint, earlier: EarlierWork | None) -> dict[str, Any]:
    """Return the state for `restored_from`: values as in JSON, the paint compressed, with all its bits.

    Args:
        resume: Checkpoint of the traversal.
        earlier: Its earlier work, if known.
    """
    if earlier is None:
        return {"checkpoint": resume._asdict()}
    rows: NDArray[np.float64] = np.ascontiguousarray(earlier.paint, "<f8")
    packed = base64.b64encode(zlib.compress(rows.tobytes(), 1)).decode()
    totals = earlier.totals._asdict() | {"paint_columns": rows.shape[1], "paint_zlib": packed}
    return {"checkpoint": resume._asdict(), "totals": totals}


def restored_from(details: Mapping[str, Any]) -> tuple[Checkpoint | None, EarlierWork | None]:
    """Read the checkpoint and the earlier work of a traversal from the details of an order, as made by `restored_json`.

    Raises:
        ValueError, KeyError, TypeError, OverflowError: They are no such details.
    """
    if "checkpoint" not in details:
        return None, None
    resume = Checkpoint(**details["checkpoint"])
    resume = resume._replace(learned=tuple(map(float, resume.learned)))
    owed_from_m = 0.0 if resume.owed_from_m is None else resume.owed_from_m
    figures: tuple[Any, ...] = (*resume._replace(owed_from_m=owed_from_m)[:-1], *resume.learned)
    if len(resume.learned) not in (0, LEARNED_FIGURES) or not all(map(math.isfinite, figures)):
        raise ValueError("a checkpoint with a number that is not finite")
    if "totals" not in details:
        return resume, None
    content = dict(details["totals"])
    columns, packed = int(content.pop("paint_columns")), str(content.pop("paint_zlib"))
    unpacker = zlib.decompressobj()
    try:
        data = unpacker.decompress(base64.b64decode(packed, validate=True), _MOST_PAINT_BYTES)
    except zlib.error as error:
        raise ValueError(f"paint that cannot be unpacked: {error}") from error
    if unpacker.unconsumed_tail:
        raise ValueError(f"paint of more than {_MOST_PAINT_BYTES:,} bytes")
    totals = Totals(tuple(content["supplies"]), tuple(content["errors"]), int(content["points"]))
    return resume, EarlierWork(totals, np.frombuffer(data, "<f8").reshape(-1, columns).copy())
