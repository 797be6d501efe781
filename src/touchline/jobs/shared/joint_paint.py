"""Paint of several robots, evaluated together against the whole template."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from touchline.jobs.single.painted_picture import painted_caption
from touchline.schemas.messages import PaintMarks
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.paint.ledger import PaintLedger
from touchline.services.robot_sim.paint.metrics import PaintMetrics, paint_metrics
from touchline.services.robot_sim.paint.projection import (
    POINT_COLUMNS,
    POINT_TARGET,
    POINT_WIDTH,
    POINT_X,
    POINT_Y,
    STROKE_BEGINS,
)
from touchline.services.robot_sim.paint.smears import Painter, wet_crossings_of
from touchline.services.robot_sim.paint.targets import Target
from touchline.services.robot_sim.paint.track import Track


@dataclass(frozen=True)
class Work:
    """Paint of one robot on one trajectory, and its poses meanwhile."""

    ledger: PaintLedger
    track: Track


@dataclass(frozen=True)
class JointPaint:
    """True paint of all robots.

    Attributes:
        metrics: Against the template.
        wet_crossings: Number of times that a wheel or caster of any robot met wet paint of any robot.
        tolerance_m: Tolerance of the template.
    """

    metrics: PaintMetrics
    wet_crossings: int
    tolerance_m: float

    def caption(self) -> str:
        """Return the main figures as a caption."""
        return painted_caption(self.figures())

    def figures(self) -> dict[str, Any]:
        """Return figures like those of one robot's paint, as far as they apply to several."""
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


def ledger_of(template: Template, vehicle: Vehicle, strokes: Iterable[PaintMarks]) -> PaintLedger:
    """Convert strokes to a ledger against the lines of a template.

    Args:
        template: Template with the lines.
        vehicle: Vehicle of the robot.
        strokes: Reported strokes.
    """
    ledger = _ledger(template, vehicle)
    for stroke in strokes:
        rows = np.zeros((len(stroke.x_m) + 1, POINT_COLUMNS))
        rows[1:, POINT_X], rows[1:, POINT_Y] = stroke.x_m, stroke.y_m
        rows[0, [POINT_X, POINT_Y]] = rows[1, [POINT_X, POINT_Y]]
        rows[0, POINT_TARGET], rows[:, POINT_WIDTH] = STROKE_BEGINS, stroke.width_m / vehicle.tool.width_m
        ledger.restore(np.delete(rows, 1, axis=0))
    return ledger


def _ledger(template: Template, vehicle: Vehicle) -> PaintLedger:
    wanted = [Target(segment.id, segment.curve()) for segment in template.segments]
    return PaintLedger(wanted, template.line_width_m, vehicle.tool.width_m, template.tolerance_m)


def joint_paint(template: Template, vehicle: Vehicle, works: Sequence[Work]) -> JointPaint:
    """Evaluate all the paint together; takes a moment.

    Args:
        template: The whole template, lines only.
        vehicle: Vehicle of every robot.
        works: Work of all robots, on one clock.
    """
    ledger = _ledger(template, vehicle)
    for work in works:
        ledger.restore(work.ledger.rows(0))
    crossings = wet_crossings_of([Painter(work.ledger, work.track) for work in works], vehicle)
    return JointPaint(paint_metrics(ledger), crossings, template.tolerance_m)
