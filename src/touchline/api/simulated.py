"""Simulations: `simulate()`, and the `Run` that it returns."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.api.data_frames import Kind, as_frame
from touchline.api.drive_table import drive_table
from touchline.api.function_follower import FunctionFollower
from touchline.api.given_arguments import Progress, no_progress, setup_of
from touchline.api.planned import Plan, plan
from touchline.jobs.single.simulation import Job, Outcome, Products
from touchline.jobs.way_round.way_round_simulation import simulate_job
from touchline.jobs.way_round.work_done import WorkDone
from touchline.onboard import Onboard
from touchline.onboard.control.follower import Follower
from touchline.onboard.interface import TICKS_PER_S
from touchline.onboard.trajectory.trajectory import load_trajectory
from touchline.schemas.errors import SpecError
from touchline.schemas.messages import AreaReport, PaintMarks, Trajectory, TraversalReport
from touchline.schemas.near_names import did_you_mean
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.template import Template
from touchline.services.robot_sim.drive_log import TICK, DriveLog, LoggedEvent
from touchline.services.robot_sim.emulator import Emulator

if TYPE_CHECKING:
    from matplotlib.axes import Axes

GivenFollower = str | Follower | Callable[[Any, Any], tuple[float, float]]


class _Drive(NamedTuple):
    """A drive of a run: its plan, and the time at which it ended (s)."""

    plan: Trajectory
    end_s: float


@dataclass(frozen=True, repr=False)
class Run:
    """A simulated plan; a robot with a lidar that goes round things does it in several drives.

    Attributes:
        plan: The plan.
        setup: Vehicle, computer and world.
        success: True if it was driven to its end, and the work is accepted.
        reason: Why not, or empty.
        report: All figures of the work, over all drives.
        figures: The report of `touchline simulate`, which also has what is left out.
        area: Figures of its areas, if a covering tool worked on some.
        events: Events that the robot reported.
        wall_time_s: Wall-clock time of the simulation.
        recording: MCAP file, if one was written.
        strokes: True paint, or ground that a tool has covered.
        log: Log of all ticks.
    """

    plan: Plan
    setup: Setup
    success: bool
    reason: str
    report: TraversalReport
    figures: dict[str, Any]
    area: AreaReport | None
    events: tuple[LoggedEvent, ...]
    wall_time_s: float
    recording: Path | None
    strokes: tuple[PaintMarks, ...]
    log: NDArray[np.float64]
    _follower: GivenFollower | None
    _drives: tuple[_Drive, ...]
    _work: WorkDone | None

    @property
    def seed(self) -> int:
        """Seed of all noise."""
        return self.setup.scenario.seed

    @property
    def duration_s(self) -> float:
        """Sim time from start to standstill, of all drives together."""
        return self.report.total_time_s

    @property
    def hash(self) -> str:
        """Hash of the session: the same as `touchline simulate --hash` prints for these inputs."""
        return self.report.session_hash

    @cached_property
    def _table(self) -> NDArray[np.void]:
        vehicle, ends_s = self.setup.vehicle, [drive.end_s for drive in self._drives[:-1]]
        parts = np.split(self.log, np.searchsorted(self.log[:, TICK] / TICKS_PER_S, ends_s, side="right"))
        tables = [
            drive_table(rows, vehicle, load_trajectory(drive.plan, vehicle))
            for drive, rows in zip(self._drives, parts, strict=True)
        ]
        table = np.concatenate(tables)
        table.flags.writeable = False
        return table

    def frame(self, *, rate_hz: float = 100.0, columns: Iterable[str] | None = None, kind: Kind = "auto") -> Any:
        """The drive as a DataFrame of pandas or polars, whichever is installed, else as a structured array.

        Its columns are those of `touchline.api.drive_table`: time_s, state, segment, station_m, truth_*, estimate_*,
        reference_*, sigma_*, lateral_error_m and so on; SI units, map frame. Segments, stations and references are
        those of the plan of the present drive.

        Args:
            rate_hz: Rows per second, picked, not averaged: 100 or a fraction of it.
            columns: Names of the columns; None: all.
            kind: "pandas", "polars", "numpy" or "auto".

        Raises:
            SpecError: There is no such column or rate.
        """
        step = TICKS_PER_S / rate_hz if rate_hz > 0.0 else 0.0
        if not step >= 1.0 or step != round(step):
            raise SpecError("Run.frame", "rate_hz", f"is {rate_hz:g}", "give 100, 50, 25, 20, 10, 5, 2 or 1")
        table = self._table[:: round(step)]
        if columns is not None:
            names = list(columns)
            for name in names:
                if name not in (table.dtype.names or ()):
                    remedy = did_you_mean(name, table.dtype.names or ()) or f"use {', '.join(table.dtype.names or ())}"
                    raise SpecError("Run.frame", name, "is not a column", remedy)
            table = table[names]
        return as_frame(table, kind)

    def errors(self) -> dict[str, float]:
        """Distances of the work from the template (m), and errors of the estimate (m, rad)."""
        report = self.report
        return {
            "lateral_mean_m": report.lateral_error_mean_m,
            "lateral_p95_m": report.lateral_error_p95_m,
            "lateral_max_m": report.lateral_error_max_m,
            "position_rmse_m": report.position_rmse_m,
            "heading_rmse_rad": report.heading_rmse_rad,
        }

    def coverage(self) -> NDArray[np.void]:
        """Figures of each painted line.

        Returns:
            (n,) id, length_m, coverage_pct, area_coverage_pct, within_tolerance_pct, gap_m, lateral_error_mean_m,
            lateral_error_p95_m and lateral_error_max_m.
        """
        names = (
            "length_m",
            "coverage_pct",
            "area_coverage_pct",
            "within_tolerance_pct",
            "gap_m",
            "lateral_error_mean_m",
            "lateral_error_p95_m",
            "lateral_error_max_m",
        )
        found = np.zeros(len(self.report.segments), [("id", "U100"), *((name, np.float64) for name in names)])
        for line, segment in zip(found, self.report.segments, strict=True):
            line["id"] = segment.id
            for name in names:
                line[name] = getattr(segment, name)
        return found

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the work: paint coloured by its distance from the template, or ground covered, twice and missed.

        Args:
            ax: Axes of matplotlib to draw into; None: those of a new figure.
        """
        from touchline.api.pictures import own_axes
        from touchline.jobs.single.work_picture import draw_work_into

        axes = own_axes(ax)
        if self._work is not None:
            self._work.draw_into(axes, self.strokes)
        else:
            draw_work_into(axes, self.plan.template, self.strokes, self.report, self.area)
        return axes

    def record(self, path: str | Path, /) -> Run:
        """Drive the same again, and record it to an MCAP file; return that run, whose hash is the same.

        Raises:
            RecordingError: The file exists or cannot be written.
        """
        return _driven(self.plan, self.setup, self._follower, Path(path), no_progress)

    def __repr__(self) -> str:
        """One line: template, outcome, time and distance from the template."""
        ended = "done" if self.success else f"failed ({self.reason})"
        off = f"{1e3 * self.report.lateral_error_mean_m:.1f} mm off on average"
        return f"Run({self.plan.template.name!r}, seed {self.seed}: {ended} in {self.duration_s:.1f} s, {off})"

    def _repr_html_(self) -> str:
        from touchline.api.pictures import figure_html

        return figure_html(repr(self), self.plot)


def simulate(
    work: Plan | Template | str | Path | Mapping[str, Any],
    /,
    *,
    scenario: Scenario | None = None,
    seed: int | None = None,
    follower: GivenFollower | None = None,
    onboard: OnboardConfig | None = None,
    record: str | Path | None = None,
    progress: Progress | None = None,
) -> Run:
    """Simulate a drive once, in this process, as fast as possible.

    Args:
        work: The plan; or a template, its name or its file, which is planned for the line marker first.
        scenario: World of the robot: ground, noise, faults; None: undisturbed, on the ground that the vehicle is for.
        seed: Seed of all noise; None: the scenario's.
        follower: Name of a follower; an object with the interface of `touchline.plugins.Follower`; or a function from
            `FollowerState` and `FollowerAhead` to the wanted speed (m/s) and yaw rate (rad/s). None: the computer's.
        onboard: Configuration of the robot's computer; None: the one that is shipped with the vehicle.
        record: MCAP file to write.
        progress: Called with the fraction done and where the robot is; may raise to end the simulation.

    Raises:
        SpecError: An argument cannot be used; names it and the remedy.
        PlanningError: The template cannot be driven.
        CommandRefused: The robot does not take the plan.
        RecordingError: The recording cannot be written.
    """
    report = progress or no_progress
    planned = work if isinstance(work, Plan) else plan(work, progress=progress)
    named = follower if isinstance(follower, str) else None
    setup = setup_of(planned.vehicle, scenario, onboard, seed, named).at(planned.template.origin)
    return _driven(planned, setup, follower, Path(record) if record is not None else None, report)


def _driven(
    planned: Plan, setup: Setup, follower: GivenFollower | None, record: Path | None, progress: Progress
) -> Run:
    job = Job(planned.template, setup.vehicle, planned.options.message(), planned.trajectory, planned.report)
    log = DriveLog(len(setup.vehicle.drive.actuators))
    products = Products(hashed=True, record=record, strokes=True, log=log)
    computer = Onboard(setup.vehicle, setup.onboard, follower=_follower_of(follower))
    emulator = Emulator(setup.vehicle, setup.scenario, setup.onboard, computer)
    done = simulate_job(job, emulator, products, progress)
    figures = done.figures(job)
    ends_s = [each.report.header.stamp.seconds for each in ((done,) if isinstance(done, Outcome) else done.drives)]
    plans = (planned.trajectory,) if isinstance(done, Outcome) else done.plans
    return Run(
        planned,
        setup,
        figures["success"],
        figures["reason"],
        done.report,
        figures,
        done.area,
        tuple(log.events),
        done.wall_time_s,
        record,
        tuple(done.strokes),
        log.rows,
        follower,
        tuple(map(_Drive, plans, ends_s)),
        None if isinstance(done, Outcome) or not done.several else done.work,
    )


def _follower_of(given: GivenFollower | None) -> Follower | None:
    """Follower for the robot's computer; None: the one that its configuration names."""
    if given is None or isinstance(given, str):
        return None
    if hasattr(given, "step"):
        return given  # type: ignore[return-value]
    if callable(given):
        return FunctionFollower(given)
    raise SpecError("simulate", "follower", f"is {given!r}", "give a name, a function, or an object with a step")
