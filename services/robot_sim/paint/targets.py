"""Lines to be painted: the template's lines or, without a template, the stretches that the trajectory sprays."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from itertools import islice
from typing import Final, NamedTuple

from touchline.core.plain_sum import plain_sum
from touchline.schemas.curves import Curve
from touchline.schemas.messages import Actuation, CurveType, LinearDirection, Segment, Trajectory
from touchline.schemas.swath_ids import area_id_of, line_id_of
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle

SHORTEST_M: Final = 0.001
"""Length below which sprayed stretches are rounding at a joint, not a line."""


class Target(NamedTuple):
    """Line to be painted, as the nozzle should draw it."""

    id: str
    curve: Curve


def targets(
    trajectory: Trajectory, template: Template | None, vehicle: Vehicle, left_out: Collection[str] = ()
) -> list[Target]:
    """Return the lines to be painted, in the order of the path; template lines that the path leaves out come last.

    The swaths of the template's areas are taken from the path, as far as it has them. Without a template the sprayed
    stretches of the path are taken, moved to the nozzle. A vehicle that does not paint has none.

    Args:
        trajectory: The plan.
        template: Its template, if there is one.
        vehicle: The robot's vehicle.
        left_out: Ids of obstructed lines of which the plan has left out parts; the parts on the path are wanted.

    Raises:
        ValueError: A sprayed segment of the trajectory is neither a line nor an arc; or the trajectory has no swath of
            an area.
    """
    if not vehicle.tool.paints:
        return []
    sprayed = list(sprayed_stretches(trajectory))
    if template is None:
        return [Target(segment.id, nozzle_curve(segment, first, last, vehicle)) for segment, first, last in sprayed]
    wanted = {segment.id: Target(segment.id, segment.curve()) for segment in template.segments}
    covered = {area.id for area in template.areas if any(area_id_of(name) == area.id for name in left_out)}
    for name in left_out:
        wanted.pop(name, None)
    for segment in trajectory.path.segments if template.areas or left_out else ():
        area = template.area_of(segment.id) or template.area_of(line_id_of(segment.id))
        if area is not None:
            covered.add(area.id)
        if area is not None or line_id_of(segment.id) in left_out:
            wanted[segment.id] = Target(segment.id, nozzle_curve(segment, 0.0, segment_length_m(segment), vehicle))
    if missing := [area.id for area in template.areas if area.id not in covered]:
        raise ValueError(f'it has no swath of the area "{missing[0]}"')
    ordered = [wanted.pop(segment.id) for segment, *_ in sprayed if segment.id in wanted]
    return ordered + list(wanted.values())


def segment_length_m(segment: Segment) -> float:
    """Return the arc length of a path segment; 0 for a turn on the spot."""
    if segment.curve.type.value == CurveType.LINE and segment.curve.line:
        line = segment.curve.line[0]
        return math.hypot(line.end.x - line.start.x, line.end.y - line.start.y)
    if segment.curve.type.value == CurveType.ARC and segment.curve.arc:
        arc = segment.curve.arc[0]
        return math.hypot(arc.start.x - arc.center.x, arc.start.y - arc.center.y) * abs(arc.sweep_angle)
    return 0.0


def sprayed_stretches(trajectory: Trajectory) -> Iterator[tuple[Segment, float, float]]:
    """Yield (segment, from, to) [m along the segment] of every stretch with the valve open, in path order."""
    steps = [(p.arc_length, bool(p.actuation.value & Actuation.VALVE)) for p in trajectory.actuation_profile.parameters]
    ends = [*(arc_length for arc_length, _ in steps[1:]), math.inf]
    spans = [(start, end) for (start, spraying), end in zip(steps, ends, strict=False) if spraying]
    begin, passed = 0.0, 0
    for segment in trajectory.path.segments:
        length = segment_length_m(segment)
        while passed < len(spans) and spans[passed][1] <= begin:
            passed += 1
        for start, end in islice(spans, passed, None):
            if start >= begin + length:
                break
            first, last = max(start - begin, 0.0), min(end - begin, length)
            if last - first > SHORTEST_M:
                yield segment, first, last
        begin += length


def nozzle_curve(segment: Segment, first_m: float, last_m: float, vehicle: Vehicle) -> Curve:
    """Return the curve that the nozzle draws while the axle centre drives a part of a segment.

    Args:
        segment: The segment.
        first_m: Distance along it at which the part begins.
        last_m: Distance at which it ends.
        vehicle: Vehicle with the nozzle.

    Raises:
        ValueError: The segment is neither a line nor an arc.
    """
    whole = Curve.from_message(segment.curve)
    x, y, tangent, _ = (float(value) for value in whole.at(first_m))
    heading = tangent + (math.pi if segment.direction.value == LinearDirection.BACKWARD else 0.0)
    cos, sin = math.cos(heading), math.sin(heading)
    ahead, left = vehicle.tool.point_m
    start = x + cos * ahead - sin * left, y + sin * ahead + cos * left
    if whole.curvature_1pm == 0.0:
        return Curve(*start, tangent, 0.0, last_m - first_m)
    radius = 1.0 / whole.curvature_1pm
    centre = (x - math.sin(tangent) * radius, y + math.cos(tangent) * radius)
    return Curve.from_arc(start, centre, (last_m - first_m) * whole.curvature_1pm)


def start_pose(trajectory: Trajectory) -> tuple[float, float, float]:
    """Return the robot's pose where a trajectory begins: x [m], y [m], heading [rad], map frame.

    Raises:
        ValueError: The trajectory has no segment of any length, or one that is neither a line nor an arc.
    """
    turned = 0.0
    for segment in trajectory.path.segments:
        if segment_length_m(segment) > 0.0:
            curve = Curve.from_message(segment.curve)
            backward = segment.direction.value == LinearDirection.BACKWARD
            return curve.x_m, curve.y_m, curve.heading_rad + (math.pi if backward else 0.0) - turned
        turned += plain_sum(arc.sweep_angle for arc in segment.curve.arc)
    raise ValueError("it has no segment of any length")
