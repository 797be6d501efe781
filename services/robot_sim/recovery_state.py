"""State restored after a crash: where a traversal goes on, and with what; also as JSON, for a recording to say so."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.onboard.interface import Checkpoint


class Totals(NamedTuple):
    """What has been used up and summed up by the tick of the checkpoint."""

    supplies: tuple[float, float, float, float]
    """As of `World`."""
    errors: tuple[float, ...]
    """(3,) as of `EstimatorError`."""
    points: int
    """Of paint, as of `PaintLedger`."""


class Remains(NamedTuple):
    """The totals, and the paint."""

    totals: Totals
    paint: NDArray[np.float64]
    """(n, 5) rows as of `PaintLedger`; fewer than `totals.points` if the rest was lost."""


def restored_json(resume: Checkpoint, remains: Remains | None) -> dict[str, Any]:
    """What `restored_from` reads: values as in JSON, the paint compressed, with all its bits."""
    if remains is None:
        return {"checkpoint": resume._asdict()}
    rows: NDArray[np.float64] = np.ascontiguousarray(remains.paint, "<f8")
    packed = base64.b64encode(zlib.compress(rows.tobytes(), 1)).decode()
    totals = remains.totals._asdict() | {"paint_columns": rows.shape[1], "paint_zlib": packed}
    return {"checkpoint": resume._asdict(), "totals": totals}


def restored_from(details: Mapping[str, Any]) -> tuple[Checkpoint | None, Remains | None]:
    """Where a traversal went on and with what, as `restored_json` has put it among the details of an order.

    Raises:
        ValueError, KeyError, TypeError: They are no such details.
    """
    if "checkpoint" not in details:
        return None, None
    resume = Checkpoint(**details["checkpoint"])
    if "totals" not in details:
        return resume, None
    told = dict(details["totals"])
    columns, packed = int(told.pop("paint_columns")), str(told.pop("paint_zlib"))
    try:
        data = zlib.decompress(base64.b64decode(packed, validate=True))
    except zlib.error as error:
        raise ValueError(f"paint that cannot be unpacked: {error}") from error
    totals = Totals(tuple(told["supplies"]), tuple(told["errors"]), int(told["points"]))
    return resume, Remains(totals, np.frombuffer(data, "<f8").reshape(-1, columns).copy())
