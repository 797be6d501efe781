"""Narrowest place of the ways between two poses that a body is too wide for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import shapely

from touchline.services.planner.free_space.convex_parts import Corner, body_parts
from touchline.services.planner.free_space.obstructed_ground import ObstructedGround
from touchline.services.planner.free_space.reachability import Proof, Reachability
from touchline.services.planner.free_space.slices import Slicer
from touchline.services.planner.geometry.clothoid import PathPose

# Bisection ends when the width is known to this (m).
WIDTH_M = 0.004


@dataclass(frozen=True)
class NarrowPlace:
    """Place that a body is too wide for.

    Attributes:
        x_m, y_m: Position of the body's origin there, map frame.
        too_narrow_m: Width by which the body would have to be reduced, half on each side.
    """

    x_m: float
    y_m: float
    too_narrow_m: float


def narrowest_place(
    ground: ObstructedGround, outline: Sequence[Corner], margin_m: float, start: PathPose, goal: PathPose
) -> NarrowPlace | None:
    """Find the place that would have to be widened least for a way to exist; None if nothing but a breach would help.

    The body is reduced on every side, by bisection, until there is a way. The place is where the ground that it reaches
    from the start comes nearest to the ground from which it reaches the goal, just before they join.

    Args:
        ground: The ground.
        outline: (n, 2) corners of the body, in its own frame (m).
        margin_m: Margin of the body for which there is no way (m).
        start: Start pose.
        goal: Goal pose; its heading may be NaN.
    """
    polygon = shapely.Polygon(outline)
    largest = float(shapely.maximum_inscribed_circle(polygon).length) - WIDTH_M
    if not _joins(ground, outline, -largest, start, goal):
        return None
    narrow, wide = margin_m, -largest
    while narrow - wide > 0.5 * WIDTH_M:
        middle = 0.5 * (narrow + wide)
        if _joins(ground, outline, middle, start, goal):
            wide = middle
        else:
            narrow = middle
    x_m, y_m = _gap(Reachability(Slicer(ground, body_parts(outline, narrow))), start, goal)
    return NarrowPlace(x_m, y_m, 2.0 * (margin_m - 0.5 * (narrow + wide)))


def _joins(
    ground: ObstructedGround, outline: Sequence[Corner], margin_m: float, start: PathPose, goal: PathPose
) -> bool:
    reachability = Reachability(Slicer(ground, body_parts(outline, margin_m)))
    return reachability.prove(start, goal) is not Proof.NONE


def _gap(reachability: Reachability, start: PathPose, goal: PathPose) -> tuple[float, float]:
    """Middle of the shortest line from the ground of the start to that of the goal, at any heading."""
    reachability.prove(start, goal)
    sides = [reachability.reached_loosely(pose) for pose in (start, goal)]
    lines = [
        shapely.shortest_line(shapely.union_all(sides[0][each]), shapely.union_all(sides[1][each]))
        for each in sides[0].keys() & sides[1].keys()
    ]
    if not lines:  # the body is so near to something at an end that no slice there is free
        return start.x_m, start.y_m
    middle = min(lines, key=lambda line: float(line.length)).centroid
    return float(middle.x), float(middle.y)
