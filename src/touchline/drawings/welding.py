"""Removal of the shortest pieces of a chain of curves, whose neighbours then meet."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from touchline.schemas.curves import Curve


def welded(curves: Sequence[Curve], closed: bool, least_m: float) -> list[Curve]:
    """Remove curves shorter than ``least_m`` (m) from a chain, which stays connected.

    Short ones that together lead further than ``least_m`` become a line; a closed chain stays closed. The chain keeps
    its beginning and its end. Curves without a short neighbour do not change.

    Args:
        curves: Connected curves.
        closed: Whether the last one ends where the first one begins.
        least_m: Minimum length of a curve.
    """
    if all(curve.length_m >= least_m for curve in curves):
        return list(curves)
    kept: list[Curve] = []
    here = (curves[0].x_m, curves[0].y_m)
    for curve in curves:
        if curve.length_m >= least_m:
            kept.append(stretched(curve, here, curve.end[:2]))
            here = curve.end[:2]
        elif np.hypot(curve.end[0] - here[0], curve.end[1] - here[1]) >= least_m:
            kept.append(Curve.from_line(here, curve.end[:2]))
            here = curve.end[:2]
    goal = (curves[0].x_m, curves[0].y_m) if closed else curves[-1].end[:2]
    if kept and here != goal:
        kept[-1] = stretched(kept[-1], (kept[-1].x_m, kept[-1].y_m), goal)
    return kept


def stretched(curve: Curve, start: tuple[float, float], end: tuple[float, float]) -> Curve:
    """Move, rotate and scale a curve to given ends; unchanged if it has them.

    An arc with coinciding ends becomes a full circle of its length.
    """
    x, y, _ = curve.end
    if (curve.x_m, curve.y_m) == start and (x, y) == end:
        return curve
    if curve.curvature_1pm == 0.0:
        return Curve.from_line(start, end)
    before, after = complex(x - curve.x_m, y - curve.y_m), complex(end[0] - start[0], end[1] - start[1])
    if abs(before) == 0.0:  # a full circle
        return replace(curve, x_m=start[0], y_m=start[1])
    if abs(after) == 0.0:
        return Curve(
            *start, curve.heading_rad, np.copysign(2.0 * np.pi / curve.length_m, curve.curvature_1pm), curve.length_m
        )
    scale, turn = abs(after) / abs(before), float(np.angle(after * before.conjugate()))
    return Curve(*start, curve.heading_rad + turn, curve.curvature_1pm / scale, curve.length_m * scale)
