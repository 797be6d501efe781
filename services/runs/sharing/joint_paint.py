"""The paint of several robots, judged together against all of the template."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.paint.ledger import PaintLedger
from touchline.services.robot_sim.paint.metrics import PaintMetrics, paint_metrics
from touchline.services.robot_sim.paint.smears import Painter, wet_crossings_of
from touchline.services.robot_sim.paint.targets import Target
from touchline.services.robot_sim.paint.track import Track


@dataclass(frozen=True)
class Work:
    """What one robot has painted on one trajectory, and where it was by then."""

    ledger: PaintLedger
    track: Track


@dataclass(frozen=True)
class JointPaint:
    """The true paint of all.

    Attributes:
        metrics: Against the template.
        wet_crossings: How often a wheel or caster of any robot came upon wet paint of any robot.
        tolerance_m: Of the template.
    """

    metrics: PaintMetrics
    wet_crossings: int
    tolerance_m: float

    def figures(self) -> dict[str, Any]:
        """As of one robot's paint, as far as it makes sense of several."""
        metrics = self.metrics
        return {
            "coverage_pct": metrics.coverage_pct,
            "area_coverage_pct": metrics.area_coverage_pct,
            "gap_m": metrics.gap_m,
            "overspray_m2": metrics.overspray_m2,
            "double_paint_m2": metrics.double_paint_m2,
            "lateral_error_m": {
                "mean": metrics.lateral.mean_m,
                "p95": metrics.lateral.p95_m,
                "max": metrics.lateral.max_m,
            },
            "wet_crossings": self.wet_crossings,
            "accepted": metrics.verdict.accepted,
            "tolerance_m": self.tolerance_m,
            "within_tolerance_pct": metrics.within_pct,
            "verdict": metrics.verdict.text,
        }


def joint_paint(template: Template, vehicle: Vehicle, works: Sequence[Work]) -> JointPaint:
    """Judge all the paint together; takes a moment.

    Args:
        template: All of it, lines alone.
        vehicle: Of every robot.
        works: Of all robots, on one clock.
    """
    wanted = [Target(segment.id, segment.curve()) for segment in template.segments]
    together = PaintLedger(wanted, template.line_width_m, vehicle.tool.width_m, template.tolerance_m)
    for work in works:
        together.restore(work.ledger.rows(0))
    crossings = wet_crossings_of([Painter(work.ledger, work.track) for work in works], vehicle)
    return JointPaint(paint_metrics(together), crossings, template.tolerance_m)
