"""Ground covered by several robots, evaluated together against all of the areas."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from touchline.jobs.shared.joint_paint import Work
from touchline.jobs.single.covered_picture import covered_caption
from touchline.jobs.single.reports import area_report_figures
from touchline.schemas.messages import AreaReport, Header, Path, Segment, Trajectory, TraversalReport
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.accounting.area_account import AreaAccount
from touchline.services.robot_sim.accounting.area_metrics import area_metrics
from touchline.services.robot_sim.area_messages import area_report, covering_report
from touchline.services.robot_sim.paint.ledger import PaintLedger
from touchline.services.robot_sim.paint.track import Track


@dataclass(frozen=True)
class JointGround:
    """Ground covered in truth.

    Attributes:
        area: Report of all areas, by the work and the plans of all robots.
        report: The verdict.
    """

    area: AreaReport
    report: TraversalReport

    @property
    def planned_pct(self) -> float:
        """Share of the areas that all plans cover together, percent."""
        return 100.0 * self.area.planned_m2 / self.area.area_m2

    def caption(self) -> str:
        """Return the main figures as a caption."""
        return covered_caption(self.area)

    def figures(self) -> dict[str, Any]:
        """Return figures like those of one robot's areas."""
        return area_report_figures(self.area, self.report)


def joint_ground(
    template: Template, vehicle: Vehicle, trajectories: Sequence[Trajectory], works: Sequence[Work]
) -> JointGround:
    """Evaluate all the ground together; takes a moment.

    Args:
        template: The whole template, areas only.
        vehicle: Vehicle of every robot; its tool covers.
        trajectories: Planned trajectories of all robots.
        works: Work of all robots.
    """
    segments: tuple[Segment, ...] = tuple(segment for each in trajectories for segment in each.path.segments)
    planned = Trajectory(path=Path(segments=segments))
    ledger, track = PaintLedger([], template.line_width_m, vehicle.tool.width_m), Track()
    for work in works:
        ledger.restore(work.ledger.rows(0))
        rows, count = track.arrays(len(work.track.rows))
        first = int(count[0])
        count[0] += len(work.track.rows)
        rows[first : count[0]] = work.track.rows
    metrics = area_metrics(AreaAccount(template, planned, vehicle), ledger, track)
    return JointGround(area_report(Header(), metrics), covering_report(Header(), metrics, done=True))
