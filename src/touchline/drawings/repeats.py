"""Detection of repeated outlines, which are painted once."""

import math
from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from touchline.core.plain_sum import plain_sum
from touchline.drawings.detail import Detail
from touchline.drawings.deviation import apart_m
from touchline.schemas.curves import Curve

#: Outlines are the same if they, and their lengths, differ by less than this fraction of the tolerance.
SAME_SHARE = 0.1


class Repeats:
    """Registry of outlines, with the number of repeated ones."""

    def __init__(self) -> None:
        self.count = 0
        self._seen: dict[tuple[int, int], list[tuple[tuple[float, ...], Sequence[Curve]]]] = defaultdict(list)
        """Index outlines by the cell, as wide as the tolerance, of their lower left corner."""

    def has(self, curves: Sequence[Curve], detail: Detail) -> bool:
        """True if ``curves`` lie on an earlier outline, in either direction; else they are added."""
        if not curves:
            return False
        near = SAME_SHARE * detail.tolerance_m
        size = _size(curves)
        column, row = (math.floor(edge / detail.tolerance_m) for edge in size[:2])
        around = ((column + i, row + j) for i in (-1, 0, 1) for j in (-1, 0, 1))
        for other, others in (seen for cell in around for seen in self._seen.get(cell, ())):
            alike = all(abs(a - b) <= detail.tolerance_m for a, b in zip(size, other, strict=True))
            if alike and apart_m(curves, others)[0] <= near:
                self.count += 1
                return True
        self._seen[column, row].append((size, curves))
        return False


def _size(curves: Sequence[Curve]) -> tuple[float, ...]:
    """Bounding box of the curves' ends and middles, and their length, m."""
    points = np.concatenate([np.column_stack(c.at(np.array([0.0, 0.5, 1.0]) * c.length_m)[:2]) for c in curves])
    return (*points.min(axis=0).tolist(), *points.max(axis=0).tolist(), plain_sum(curve.length_m for curve in curves))
