"""Areas that a robot has covered in several drives, and the patches that it has left out."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import shapely

from touchline.core.robust_overlay import difference
from touchline.jobs.shared.joint_ground import JointGround, joint_ground
from touchline.jobs.shared.joint_paint import Work
from touchline.jobs.single.covered_picture import cover
from touchline.schemas.messages import AreaReport, PaintMarks, Trajectory, TraversalReport
from touchline.schemas.plain_text import plain
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plots.ground import MISSED
from touchline.services.robot_sim.accounting.swept_ground import swept_ground
from touchline.services.robot_sim.way_round.remains import OPERATOR, PLAN, TOO_SMALL
from touchline.services.robot_sim.way_round.uncovered_ground import LeftOutGround, corners_of, patches_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_WORDS: Final = {"": "not covered", OPERATOR: "left out by the operator", TOO_SMALL: "too small for another drive"}


class UncoveredPatch(NamedTuple):
    """Patch of an area that is not covered.

    Attributes:
        area_id: Id of the area.
        ground: The patch (m, map frame).
        reason: As in `Remains`.
    """

    area_id: str
    ground: shapely.Polygon
    reason: str

    @property
    def words(self) -> str:
        """Size, area, place and reason as text."""
        why = _WORDS.get(self.reason, f'left out beside "{self.reason}"')
        place = self.ground.representative_point()
        return f'{self.ground.area:.2f} m² of "{self.area_id}" at ({place.x:.2f}, {place.y:.2f}): {why}'

    @property
    def figures(self) -> dict[str, Any]:
        """The patch as figures of a report."""
        return {
            "area": self.area_id,
            "size_m2": float(self.ground.area),
            "outline_m": [[x, y] for x, y in corners_of(self.ground)],
            "reason": self.reason or "not covered",
        }


@dataclass(frozen=True)
class CoveredAreas:
    """Areas covered in several drives; see `WorkDone`.

    Attributes:
        template: The whole template.
        ground: Ground covered in truth, against what the robot drove of its plans.
        patches: Uncovered patches, the largest first.
    """

    template: Template
    ground: JointGround
    patches: tuple[UncoveredPatch, ...]

    @property
    def report(self) -> TraversalReport:
        """See `WorkDone`."""
        return self.ground.report

    @property
    def area(self) -> AreaReport:
        """See `WorkDone`."""
        return self.ground.area

    @property
    def refusal(self) -> str:
        """See `WorkDone`."""
        return "" if self.report.paint_accepted else f"the work is not accepted: {self.report.verdict}"

    def figures(self) -> dict[str, Any]:
        """See `WorkDone`."""
        return {
            "area": self.ground.figures(),
            "uncovered": uncovered_figures(self.area.missed_m2, self.patches),
        }

    def warnings(self) -> Iterator[str]:
        """See `WorkDone`."""
        return (each.words for each in self.patches if each.reason != PLAN)

    def draw_into(self, axes: "Axes", strokes: Iterable[PaintMarks]) -> None:
        """See `WorkDone`."""
        cover(axes, self.template, strokes, self.ground.caption())
        for patch in self.patches:
            if patch.reason != PLAN:
                axes.plot(*patch.ground.exterior.xy, color=MISSED, linestyle=":", gid="uncovered")
                place = patch.ground.representative_point()
                name = plain(patch.reason or "not covered")
                axes.annotate(
                    name, (place.x, place.y), (3, -9), textcoords="offset points", color=MISSED, fontsize="x-small"
                )


def uncovered_figures(total_m2: float, patches: Sequence[UncoveredPatch]) -> dict[str, Any]:
    """Return what is not covered as figures of a report.

    Args:
        total_m2: Size of all that is not covered.
        patches: The larger patches of it.
    """
    return {
        "total_m2": total_m2,
        "left_out_m2": math.fsum(each.ground.area for each in patches if each.reason != PLAN),
        "patches": [each.figures for each in patches],
    }


def covered_areas(
    template: Template,
    vehicle: Vehicle,
    driven: Sequence[Trajectory],
    works: Sequence[Work],
    notes: Sequence[LeftOutGround],
) -> CoveredAreas:
    """Evaluate all the ground together; takes a moment.

    Args:
        template: The whole template, areas only.
        vehicle: The vehicle; its tool covers.
        driven: Path that the robot drove of each of its plans.
        works: True work of each drive.
        notes: Ground left out, by the robot's own record.
    """
    swept = swept_ground([stroke for work in works for stroke in work.ledger.strokes()]).swept
    found = [
        UncoveredPatch(area.id, part, reason)
        for area in template.areas
        for part, reason in patches_of(notes, area.id, difference(area.polygon, swept))
    ]
    found.sort(key=lambda each: -each.ground.area)
    return CoveredAreas(template, joint_ground(template, vehicle, driven, works), tuple(found))
