"""Dashes of dashed lines."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import accumulate, cycle

from touchline.core.plain_sum import plain_sum
from touchline.drawings.fit import fit_outline
from touchline.drawings.outline import Outline
from touchline.drawings.outline_clipping import part_of
from touchline.schemas.curves import Curve

#: Maximum number of dashes of one line.
MOST_DASHES = 5_000
#: Minimum length of a dash, m.
_LEAST_M = 1e-6


def dashed(outline: Outline, pattern_m: Sequence[float], offset_m: float) -> list[Outline] | None:
    """Divide an outline into dashes; None if there are too many.

    Args:
        outline: Outline of a line.
        pattern_m: Lengths of dash, gap, dash, …; their number is even and their sum above 0.
        offset_m: Position in the pattern at which the line begins.
    """
    curves = fit_outline(outline)
    length = plain_sum(curve.length_m for curve in curves)
    period = plain_sum(pattern_m)
    if length / period * len(pattern_m) > MOST_DASHES:
        return None
    found = []
    for count, (begin, end) in enumerate(_dashes(pattern_m, offset_m % period, length), 1):
        pieces = tuple(_between(curves, begin, end))
        if pieces:
            name = outline.name if count == 1 else f"{outline.name}-dash-{count}"
            found.append(replace(outline, name=name, pieces=pieces, closed=False))
    return found


def _dashes(pattern_m: Sequence[float], offset_m: float, length_m: float) -> Iterator[tuple[float, float]]:
    """Begin and end (m) of each dash along a line."""
    at = -offset_m
    for index, part in cycle(enumerate(pattern_m)):
        if at >= length_m:
            return
        begin, end = max(at, 0.0), min(at + part, length_m)
        if index % 2 == 0 and end - begin > _LEAST_M:
            yield begin, end
        at += part


def _between(curves: Sequence[Curve], begin_m: float, end_m: float) -> Iterator[Curve]:
    stops = [0.0, *accumulate(curve.length_m for curve in curves)]
    for curve, start, stop in zip(curves, stops, stops[1:], strict=False):
        first, last = max(begin_m, start) - start, min(end_m, stop) - start
        if last - first > _LEAST_M:
            yield part_of(curve, first, min(last, curve.length_m))
