"""What is left of a template when robots stop before they are done, and what stands in the way of the rest."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from touchline.core.arcs import abreast, unit
from touchline.core.robust_overlay import buffer
from touchline.onboard.interface import PaintBelief
from touchline.schemas.curves import Curve
from touchline.schemas.errors import PlanningError
from touchline.schemas.template import Polygon, Template, TemplateSegment
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.collision.clear_lines import part_of, redrawn
from touchline.services.planner.plan import Plan

OVERLAP_M: Final = 0.005
"""Where a line is taken up again, paint begins so far before it stopped, as after a pause."""
DONE_M: Final = 0.02
"""What is left of a line that is shorter than this is not painted any more."""
SHORTER_M: Final = 1.0
"""Of a line that ends beside a robot that stands there so much more is left out, if nothing gets past it."""
NEAR_M: Final = 6.0
"""Beside it is no further than this from its middle."""


@dataclass(frozen=True)
class Standing:
    """A robot that stands on the field and will not move.

    Attributes:
        name: For people.
        pose: Where: x (m), y (m), heading (rad).
    """

    name: str
    pose: tuple[float, float, float]

    def outline(self, vehicle: Vehicle, apart_m: float) -> Polygon:
        """Its body and the room that others leave round it."""
        import shapely

        x, y, heading = self.pose
        cos, sin = math.cos(heading), math.sin(heading)
        body = shapely.Polygon([(x + cos * a - sin * b, y + sin * a + cos * b) for a, b in vehicle.body.footprint_m])
        room = shapely.simplify(buffer(body, apart_m, quad_segs=4), 0.01)
        corners = shapely.get_coordinates(room)[:-1].tolist()
        return Polygon(id=f"robot {self.name}", corners=tuple((a, b) for a, b in corners))


def unfinished(plan: Plan, share: Template, painted: PaintBelief) -> list[TemplateSegment]:
    """The lines of a share that are not painted yet, and the rest of one that was begun, by what the robot believes.

    A line is painted from its beginning on; what is taken up again begins `OVERLAP_M` before where it stopped.

    Args:
        plan: That the robot was on.
        share: What it was to paint.
        painted: What it believes of that.
    """
    shares = dict(zip(painted.ids, painted.fractions, strict=True))
    strokes = {line.id: line.stroke for line in plan.sent if line.stroke}
    left = list[TemplateSegment]()
    for segment in share.segments:
        nozzle, done = strokes[segment.id].nozzle, shares.get(segment.id, 0.0)
        if done == 0.0:
            left.append(segment)
        elif (1.0 - done) * nozzle.length_m > DONE_M:
            from_m = max(done * nozzle.length_m - OVERLAP_M, 0.0)
            left.append(redrawn(segment, part_of(nozzle, from_m, nozzle.length_m)))
    return left


def left_out(before: Template, after: Template) -> list[TemplateSegment]:
    """The parts of the lines of a template that another one made of it has not, with `OVERLAP_M` at each joint.

    Args:
        before: With all lines.
        after: With parts of them, under their ids or under ids made of those.
    """
    whole = {segment.id for segment in before.segments}
    left = list[TemplateSegment]()
    for segment in before.segments:
        parts = [
            part.curve()
            for part in after.segments
            if part.id == segment.id or (part.id not in whole and part.id.startswith(f"{segment.id} ("))
        ]
        curve = segment.curve()
        at_m, found = 0.0, list[tuple[float, float]]()
        for from_m, to_m in [*sorted(_span(curve, part) for part in parts), (curve.length_m, curve.length_m)]:
            if from_m - at_m > DONE_M:
                found.append((max(at_m - OVERLAP_M, 0.0), min(from_m + OVERLAP_M, curve.length_m)))
            at_m = max(at_m, to_m)
        left += [
            redrawn(segment, part_of(curve, from_m, to_m), f"{segment.id} (left {number})")
            for number, (from_m, to_m) in enumerate(found, start=1)
        ]
    return left


def _span(curve: Curve, part: Curve) -> tuple[float, float]:
    """From where to where along a line or an arc a part of it lies, m."""
    row = np.array((curve.x_m, curve.y_m, curve.heading_rad, curve.curvature_1pm, curve.length_m))
    x, y, _ = part.end
    ends = [abreast(complex(*place), row, unit(curve.heading_rad)) for place in ((part.x_m, part.y_m), (x, y))]
    return min(ends), max(ends)


def shortened(template: Template, error: PlanningError, standing: Sequence[Standing]) -> Template | None:
    """The template without what keeps a plan from getting past a robot that stands there; None if there is no such.

    It is the end of a line next to the robot: `SHORTER_M` of it. Where no line ends near one, the line that the error
    names is left out.

    Args:
        template: That cannot be planned.
        error: Why not.
        standing: The robots.
    """
    ends = [
        (math.dist(place, each.pose[:2]), number, last)
        for number, segment in enumerate(template.segments)
        for last, place in enumerate((_start_of(segment), segment.curve().end[:2]))
        for each in standing
    ]
    off_m, number, last = min(ends, default=(math.inf, 0, 0))
    kept = list(template.segments)
    if off_m < NEAR_M:
        curve = kept[number].curve()
        left_m = curve.length_m - SHORTER_M
        kept[number : number + 1] = (
            [redrawn(kept[number], part_of(curve, 0.0 if last else SHORTER_M, left_m if last else curve.length_m))]
            if left_m > SHORTER_M
            else []
        )
    elif standing:
        kept = [segment for segment in kept if segment.id != error.segment_id]
    return template.model_copy(update={"segments": tuple(kept)}) if kept and kept != list(template.segments) else None


def _start_of(segment: TemplateSegment) -> tuple[float, float]:
    curve = segment.curve()
    return curve.x_m, curve.y_m
