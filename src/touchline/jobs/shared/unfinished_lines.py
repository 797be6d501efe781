"""Unfinished lines of a template when robots stop early, and robots that stand in the way of the rest."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from touchline.onboard.interface import PaintBelief
from touchline.schemas.curves import Curve
from touchline.schemas.errors import PlanningError
from touchline.schemas.line_parts import DONE_M, OVERLAP_M, gaps_between, part_of, redrawn, with_overlap
from touchline.schemas.template import Polygon, Template, TemplateSegment
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import Plan
from touchline.services.robot_sim.grown_outlines import body_at, grown
from touchline.services.robot_sim.way_round.unpainted_lines import station_m

SHORTER_M: Final = 1.0
"""Length by which a line beside a standing robot is shortened per attempt."""
NEAR_M: Final = 6.0
"""Largest distance of a line's end from a standing robot's middle to count as beside it."""


@dataclass(frozen=True)
class Standing:
    """Robot that stands on the field and will not move.

    Attributes:
        name: Name for people.
        pose: x (m), y (m), heading (rad), map frame.
    """

    name: str
    pose: tuple[float, float, float]

    def outline(self, vehicle: Vehicle, apart_m: float) -> Polygon:
        """Return the body with the clearance that others keep.

        Args:
            vehicle: Vehicle of the robot.
            apart_m: Clearance.
        """
        return grown(f"robot {self.name}", body_at(self.pose, vehicle), apart_m)


def unfinished(plan: Plan, share: Template, painted: PaintBelief) -> list[TemplateSegment]:
    """Return the lines of a share not painted yet, and the rest of one that was begun, by the robot's paint record.

    A line is painted from its beginning; a rest begins `OVERLAP_M` before where painting stopped.

    Args:
        plan: The robot's plan.
        share: Its share of the template.
        painted: Its own paint record.
    """
    shares = dict(zip(painted.ids, painted.fractions, strict=True))
    strokes = {line.id: line.stroke for line in plan.sent if line.stroke}
    remaining = list[TemplateSegment]()
    for segment in share.segments:
        nozzle, done = strokes[segment.id].nozzle, shares.get(segment.id, 0.0)
        if done == 0.0:
            remaining.append(segment)
        elif (1.0 - done) * nozzle.length_m > DONE_M:
            from_m = max(done * nozzle.length_m - OVERLAP_M, 0.0)
            remaining.append(redrawn(segment, part_of(nozzle, from_m, nozzle.length_m)))
    return remaining


def left_out(before: Template, after: Template) -> list[TemplateSegment]:
    """Return the parts of a template's lines that a template made of it lacks, with `OVERLAP_M` at each joint.

    Args:
        before: The template with all lines.
        after: The template with parts of them, under their ids or ids derived from those.
    """
    whole = {segment.id for segment in before.segments}
    remaining = list[TemplateSegment]()
    for segment in before.segments:
        parts = [
            part.curve()
            for part in after.segments
            if part.id == segment.id or (part.id not in whole and part.id.startswith(f"{segment.id} ("))
        ]
        curve = segment.curve()
        missing = gaps_between([_span(curve, part) for part in parts], curve.length_m)
        remaining += [
            redrawn(segment, with_overlap(curve, gap), f"{segment.id} (left {number})")
            for number, gap in enumerate(missing, start=1)
        ]
    return remaining


def _span(curve: Curve, part: Curve) -> tuple[float, float]:
    """Return from and to (m) of a part along its line or arc."""
    x, y, _ = part.end
    ends = [station_m(curve, *place) for place in ((part.x_m, part.y_m), (x, y))]
    return min(ends), max(ends)


def shortened(template: Template, error: PlanningError, standing: Sequence[Standing]) -> Template | None:
    """Return the template without the part that blocks a plan at a standing robot; None if there is no such part.

    It is `SHORTER_M` of the end of a line next to the robot. If no line ends near one, the line that the error names is
    left out.

    Args:
        template: The template that cannot be planned.
        error: Reason of the failure.
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
