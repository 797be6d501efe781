"""Study of area coverage: its planner and tracker reproduced, and compared with ours.

Source: the published study of an autonomous roller for salt farming, with a planner and a tracker for a rear-steered
vehicle. It gives neither the size of its field nor the working width: its results, 97.3 % planned, 95.8 % driven and
34 min, are of another field than those of these rows.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from statistics import fmean
from typing import Final

import shapely

from touchline.core.robust_overlay import intersection
from touchline.jobs.single.simulation import Job, simulate
from touchline.schemas.catalogue import load_template
from touchline.schemas.messages import PlanOptions
from touchline.schemas.onboard import FenceLimits, LanePursuit, OnboardConfig
from touchline.schemas.scenario import Ground, Scenario
from touchline.schemas.vehicles.shipped import CLAY_ROLLER, SHIPPED
from touchline.services.planner.coverage.coverage_machine import machine_of
from touchline.services.planner.coverage.coverage_route import DriveKind
from touchline.services.planner.coverage.swept_area import body_outside_m, swept
from touchline.services.planner.coverage.zigzag import ZigzagOptions, zigzag
from touchline.services.planner.limits import Limits
from touchline_research.target_table import against_targets

FIELD: Final = "salt-pan"
UNFENCED_M: Final = 3.0
"""Distance (m) by which the body may leave the field, as the study's plan needs."""
CLAY: Final = Scenario(ground=Ground(surface=SHIPPED[CLAY_ROLLER.name].surface))

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class CoverageRow:
    """One line of the table.

    Attributes:
        name: Plan or drive that the row is about.
        coverage_pct: Coverage of the field; of drives the mean over all seeds, like all other figures.
        share_pct: Coverage of the reachable area; of drives the minimum share of the planned coverage.
        minutes: Time from rest to rest.
        cusps: Number of cusps of the plan.
        p95_m: 95th percentile of the drum's lateral error; None for plans.
        body_outside_m: Maximum distance of the body beyond the field.
        must: Targets in words; "" for information.
        met: Whether they are met.
        note: Remark for the reader.
    """

    name: str
    coverage_pct: float
    share_pct: float
    minutes: float
    cusps: int
    p95_m: float | None
    body_outside_m: float
    must: str = ""
    met: bool | None = None
    note: str = ""


@dataclass(frozen=True)
class Bounds:
    """Targets of a row; fields with their default are no targets."""

    coverage_pct: tuple[float, float] = (0.0, 100.0)
    share_pct: float = 0.0
    minutes: tuple[float, float] | None = None
    cusps: int | None = None
    p95_m: float | None = None
    body_outside_m: float | None = None

    def evaluated(self, row: CoverageRow) -> CoverageRow:
        """Add the targets to a row, and whether it meets them."""
        asked: list[tuple[str, bool]] = []
        low, high = self.coverage_pct
        if low:
            text = f"{low:g} to {high:g} %" if high < 100.0 else f"≥ {low:g} %"
            asked.append((text, low <= row.coverage_pct <= high))
        if self.share_pct:
            asked.append((f"≥ {self.share_pct:g} % of that", row.share_pct >= self.share_pct))
        if self.minutes:
            begin, end = self.minutes
            text = f"{begin:g} to {end:g} min" if begin else f"≤ {end:g} min"
            asked.append((text, begin <= row.minutes <= end))
        if self.cusps is not None:
            asked.append((f"{self.cusps} cusps", row.cusps == self.cusps))
        if self.p95_m is not None:
            asked.append((f"p95 ≤ {1e2 * self.p95_m:g} cm", (row.p95_m or 0.0) <= self.p95_m))
        if self.body_outside_m is not None:
            text = f"body ≤ {1e2 * self.body_outside_m:g} cm outside"
            asked.append((text, row.body_outside_m <= self.body_outside_m))
        must, met = against_targets(asked)
        return replace(row, must=must, met=met)


@dataclass(frozen=True)
class ZigzagCase:
    """Plan of the study's planner on a field, ignoring the body."""

    name: str
    length_m: float
    width_m: float
    must: Bounds | None = None
    overlapping: float = 1.0
    angle_rad: float = 0.0

    def row(self) -> CoverageRow:
        """Plan at the vehicle's speed and acceleration, with stops only at cusps."""
        machine = machine_of(CLAY_ROLLER, Limits.of(CLAY_ROLLER, PlanOptions()))
        field = shapely.box(-self.length_m / 2, -self.width_m / 2, self.length_m / 2, self.width_m / 2)
        route = zigzag(field, machine, ZigzagOptions(overlapping=self.overlapping), self.angle_rad)
        paths = [piece.path for piece in route.pieces]
        rolled = intersection(swept(paths, machine.width_m), field).area
        share = 100.0 * rolled / field.area
        lanes = sum(piece.kind is DriveKind.LANE for piece in route.pieces)
        outside = body_outside_m(paths, machine, field)
        minutes = route.seconds(machine) / 60.0
        row = CoverageRow(self.name, share, share, minutes, route.cusps, None, outside, note=f"{lanes} lanes")
        return self.must.evaluated(row) if self.must else row


@dataclass(frozen=True)
class PlannedCase:
    """Plan of ours of the salt pan."""

    name: str
    options: PlanOptions
    must: Bounds

    def row(self) -> CoverageRow:
        """Plan as `touchline plan` does."""
        report = _job(self.options).plan_report
        figures = report.coverage[0]
        note = f"{figures.lanes} lanes, planned in {report.planning_time_s:.1f} s"
        row = CoverageRow(
            self.name,
            figures.coverage_pct,
            figures.reachable_pct,
            report.total_time_s / 60.0,
            report.cusps,
            None,
            figures.body_outside_m,
            note=note,
        )
        return self.must.evaluated(row)


@dataclass(frozen=True)
class DrivenCase:
    """A plan of the salt pan driven by the emulated roller, with default noise."""

    name: str
    options: PlanOptions
    config: OnboardConfig
    must: Bounds | None = None

    def row(self, seeds: int) -> CoverageRow:
        """Drive with a number of seeds."""
        job = _job(self.options)
        outcomes = [simulate(job, CLAY.model_copy(update={"seed": seed}), self.config) for seed in range(1, seeds + 1)]
        areas = [outcome.area for outcome in outcomes if outcome.area]
        row = CoverageRow(
            self.name,
            fmean(area.coverage_pct for area in areas),
            min(area.of_planned_pct for area in areas),
            fmean(outcome.report.total_time_s for outcome in outcomes) / 60.0,
            job.plan_report.cusps,
            fmean(area.lateral_error_p95_m for area in areas),
            max(area.body_outside_m for area in areas),
            note=f"{seeds} seeds, drum at most {1e2 * max(area.lateral_error_max_m for area in areas):.1f} cm off",
        )
        return self.must.evaluated(row) if self.must else row


def _job(options: PlanOptions) -> Job:
    return Job.prepare(load_template(FIELD), options, CLAY_ROLLER)


ZIGZAG = PlanOptions(area_method="zigzag")
UNFENCED = FenceLimits(boundary_margin_m=UNFENCED_M)
LANES = OnboardConfig(follower="pursuit-lanes", fence=UNFENCED)
PURSUIT = OnboardConfig(follower=SHIPPED[CLAY_ROLLER.name].follower)
NEAR = LANES.model_copy(update={"lane_pursuit": LanePursuit(lookahead_m=1.5)})

ZIGZAGS = (
    ZigzagCase("zigzag, 93 × 47.6 m", 93.0, 47.6, Bounds((97.4, 97.8), minutes=(37.0, 38.1))),
    ZigzagCase("zigzag, 90 × 44.6 m", 90.0, 44.6),
    ZigzagCase("zigzag, each place twice", 93.0, 47.6, Bounds((99.9, 100.0)), overlapping=2.0),
    ZigzagCase("zigzag, lanes across", 93.0, 47.6, angle_rad=-math.pi / 2),
)
PLANNED = (
    PlannedCase(
        "ours, forward only",
        PlanOptions(forward_only=True),
        Bounds((98.9, 100.0), 99.2, (0.0, 37.0), 0, body_outside_m=0.0),
    ),
    PlannedCase("ours", PlanOptions(), Bounds((99.4, 100.0), 99.75, (0.0, 39.0), body_outside_m=0.0)),
    PlannedCase(
        "ours, to 99.9 %", PlanOptions(coverage_pct=99.9), Bounds((0.0, 100.0), 99.9, (0.0, 41.0), body_outside_m=0.0)
    ),
)
DRIVEN = (
    DrivenCase("zigzag by pursuit-lanes, 5 m ahead", ZIGZAG, LANES, Bounds((94.2, 95.6), minutes=(36.0, 38.0))),
    DrivenCase("zigzag by pursuit-lanes, 1.5 m ahead", ZIGZAG, NEAR),
    DrivenCase("ours, forward only, by pure pursuit", PlanOptions(forward_only=True), PURSUIT),
    DrivenCase(
        "ours by pure pursuit",
        PlanOptions(),
        PURSUIT,
        Bounds((99.3, 100.0), 99.8, (0.0, 39.0), p95_m=0.05, body_outside_m=0.05),
    ),
    DrivenCase("ours by mpc", PlanOptions(), OnboardConfig()),
    DrivenCase("ours by pursuit-lanes, 5 m ahead", PlanOptions(), LANES),
)


def run_coverage_study(seeds: int, progress: Progress = lambda what, done: None) -> list[CoverageRow]:
    """Measure all rows.

    Args:
        seeds: Number of drives of each driven row.
        progress: Called with the current measurement and the fraction of it that is done.
    """
    todo: Sequence[tuple[str, Callable[[], CoverageRow]]] = [
        *((case.name, case.row) for case in ZIGZAGS),
        *((case.name, case.row) for case in PLANNED),
        *((case.name, partial(case.row, seeds)) for case in DRIVEN),
    ]
    rows: list[CoverageRow] = []
    for number, (what, row) in enumerate(todo):
        progress(what, number / len(todo))
        rows.append(row())
    return rows
