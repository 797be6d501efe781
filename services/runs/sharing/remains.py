"""What is left of a template when robots stop before they are done, and what stands in the way of the rest."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from touchline.schemas.errors import PlanningError
from touchline.schemas.template import Polygon, Template, TemplateSegment
from touchline.schemas.vehicles import Vehicle
from touchline.services.onboard.interface import PaintBelief
from touchline.services.planner.plan import Plan
from touchline.services.planner.sharing.clear_lines import part_of, redrawn

OVERLAP_M: Final = 0.005
"""Where a line is taken up again, paint begins so far before it stopped, as after a pause."""
DONE_M: Final = 0.02
"""What is left of a line that is shorter than this is not painted any more."""
SHORTER_M: Final = 1.0
"""A line that cannot be reached beside a robot that stands there is left out by this much more at that end."""


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
        room = shapely.simplify(shapely.buffer(body, apart_m, quad_segs=4), 0.01)
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


def shortened(template: Template, error: PlanningError, standing: Sequence[Standing]) -> Template | None:
    """The template without the end of the line that an error names, the one nearer to a standing robot; None if none.

    A line that would be shorter than that is left out.
    """
    named = [segment for segment in template.segments if segment.id == error.segment_id]
    if not named or not standing:
        return None
    (segment,), changed = named, list[TemplateSegment]()
    curve = segment.curve()
    if curve.length_m > 2.0 * SHORTER_M:
        off = [
            min(math.dist(place, each.pose[:2]) for each in standing)
            for place in ((curve.x_m, curve.y_m), curve.end[:2])
        ]
        first = SHORTER_M if off[0] <= off[1] else 0.0
        changed.append(redrawn(segment, part_of(curve, first, first + curve.length_m - SHORTER_M)))
    kept = [each for old in template.segments for each in (changed if old is segment else [old])]
    return template.model_copy(update={"segments": tuple(kept)}) if kept else None
