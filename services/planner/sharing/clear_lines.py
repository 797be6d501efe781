"""The parts of lines that can be painted round what stands on the field."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from touchline.schemas.curves import Curve, wrap_angle
from touchline.schemas.template import ArcSpec, LineSpec, Template, TemplateSegment
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.collision.checker import MARGIN_M, CollisionChecker, first_touch
from touchline.services.planner.limits import Limits
from touchline.services.planner.swaths.offset import Stroke, modes

LOOKED_AT_M = 0.1
"""Lines are looked at so often."""
LEAST_M = 0.3
"""Shorter parts are left out."""


def clear_lines(template: Template, vehicle: Vehicle, limits: Limits) -> tuple[TemplateSegment, ...]:
    """The parts of the template's lines along which the body touches no outline, each in the better direction.

    A line in several parts has the first one under its own id, and the others under ids made of that.

    Args:
        template: Whose lines, boundary and obstacles.
        vehicle: That paints them.
        limits: Of its plans.

    Raises:
        PlanningError: An arc is too tight for the robot.
    """
    checker = CollisionChecker.of(template, vehicle)
    if checker is None:
        return template.segments
    found = list[TemplateSegment]()
    choices = modes(template.segments, vehicle, limits.curvature_max_1pm)
    for segment, choice in zip(template.segments, choices, strict=True):
        parts = max((_clear(stroke, checker) for stroke in choice), key=lambda each: sum(b - a for a, b in each))
        if parts == [(0.0, 1.0)]:
            found.append(segment)
            continue
        length_m = segment.curve().length_m
        stroke = next(each for each in choice if _clear(each, checker) == parts)
        long = [(a * length_m, b * length_m) for a, b in parts if (b - a) * length_m >= LEAST_M]
        names = (segment.id, *(f"{segment.id} ({number})" for number in range(2, len(long) + 1)))
        found += [
            redrawn(segment, part_of(stroke.nozzle, a, b), name) for name, (a, b) in zip(names, long, strict=False)
        ]
    return tuple(found)


def _clear(stroke: Stroke, checker: CollisionChecker) -> list[tuple[float, float]]:
    """The shares of a stroke, from → to, along which the body is clear."""
    count = 2 + math.ceil(stroke.robot.length_m / LOOKED_AT_M)
    share = np.linspace(0.0, 1.0, count)
    poses = np.column_stack(stroke.robot.at(share * stroke.robot.length_m)[:3])
    edges, owner, body = checker.edges, checker.owner, checker.body
    clear = [first_touch(poses[k : k + 1], edges, owner, checker.bounded, body, MARGIN_M)[0] < 0 for k in range(count)]
    return list(_runs(share.tolist(), clear))


def _runs(share: Sequence[float], clear: Sequence[bool]) -> Iterator[tuple[float, float]]:
    """From → to of the runs of what is clear, single places left out."""
    state = np.concatenate(([False], clear, [False])).astype(np.int8)
    begins, ends = np.flatnonzero(np.diff(state) == 1).tolist(), np.flatnonzero(np.diff(state) == -1).tolist()
    for first, last in zip(begins, ends, strict=True):
        if last - 1 > first:
            yield share[first], share[last - 1]


def part_of(curve: Curve, from_m: float, to_m: float) -> Curve:
    """A part of a line or an arc."""
    x, y, heading, _ = (float(value) for value in curve.at(from_m))
    return replace(curve, x_m=x, y_m=y, heading_rad=wrap_angle(heading), length_m=to_m - from_m)


def redrawn(segment: TemplateSegment, curve: Curve, name: str = "") -> TemplateSegment:
    """The segment along another curve, under another name if that is given."""
    line: LineSpec | None = None
    arc: ArcSpec | None = None
    start = curve.x_m, curve.y_m
    if curve.curvature_1pm == 0.0:
        line = LineSpec(start=start, end=curve.end[:2])
    else:
        radius = 1.0 / curve.curvature_1pm
        center = start[0] - radius * math.sin(curve.heading_rad), start[1] + radius * math.cos(curve.heading_rad)
        arc = ArcSpec(start=start, center=center, sweep_angle=curve.curvature_1pm * curve.length_m)
    return segment.model_copy(update={"id": name or segment.id, "line": line, "arc": arc})
