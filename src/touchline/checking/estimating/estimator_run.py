"""Estimator run: the present estimator on the sensors of a session, without the executive."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, cast

import numpy as np
from numpy.typing import NDArray

from touchline.checking.estimating.estimator_inputs import EstimatorInputs
from touchline.checking.estimator_ticks import EstimatedTicks, EstimatorTicks
from touchline.checking.recorded_session import NotRebuilt
from touchline.onboard.estimation.adaptation import WALK_M2PM
from touchline.onboard.estimation.aiding.gnss_aiding import FIX_FIXED
from touchline.onboard.estimation.filter import AcceptedJump
from touchline.onboard.estimation.frame_series import COVARIANCE, SIGMAS, TWIST_COVARIANCE, FrameSeries
from touchline.onboard.estimation.learned_constants import LearnedConstant
from touchline.onboard.estimation.report import report
from touchline.onboard.estimation.tail import CONTRADICTED
from touchline.onboard.filter_model import FIX_DOF, FilterCounters
from touchline.onboard.interface import Consistency
from touchline.recordings.logs.reversals import Span
from touchline.schemas.setup import Setup
from touchline.schemas.vehicles import ODOMETRY

Floats = NDArray[np.float64]

TRACK_TICKS: Final = 10
"""Ticks between two rows of the track."""
_SLICE_TICKS = 1000

FIX_COLUMNS: Final = ("time_s", "east_m", "north_m", "innovation_east_m", "innovation_north_m", "nis_weighed", "used")
WHITE_COLUMNS: Final = ("fix_white_0", "fix_white_1", "fix_log_det")
TRACK_COLUMNS: Final = ("time_s", "east_m", "north_m", "heading_rad", "position_sigma_m", "heading_sigma_rad")


@dataclass
class Jump:
    """Correction of the position to the receiver's, after fixes contradicted the estimate for good."""

    time_s: float
    jump: AcceptedJump


@dataclass
class EstimatorRun:
    """Result of an estimator run.

    Attributes:
        setup: Setup of the session.
        robot: Namespace of the robot.
        duration_s: Sim time of the session.
        receiver: (n, 6) all fixes: time, east, north [m], reported σ [m], kind as in `GnssStatus`, age of corrections.
        fixes: (n, FIX_COLUMNS) fixes that came while the estimator ran; `used` is 1 or 0.
        track: (n, TRACK_COLUMNS) estimates, every `TRACK_TICKS`.
        poses: (ticks + 1, 3) estimates of every tick; NaN where there is none.
        covariances: (ticks + 1, 3, 3) covariances of `poses`.
        white: (ticks + 1, WHITE_COLUMNS) normalised innovations of fixes, see `FilterCounters`; NaN where none is.
        reference: (n, 4) time, east, north, heading of the truth or of a reference; heading may be NaN.
        of_antenna: Whether the reference is the antenna's.
        emulated: Whether the reference is an emulator's truth.
        jumps: Accepted jumps.
        starts_s: Times at which the estimator started.
        contradicted_s: Time for which fixes contradicted the estimate.
        strays: Number of times at which the estimate had strayed from the fixes, and was led back.
        stray_most_m: Largest distance by which it had.
        wander_most_m_rtm: Largest unmodelled walk that was assumed.
        consistency: Consistency of the estimator at the end.
        fix_lag: Number of fixes between innovations that are independent if all is right.
        constants: Constants of the robot as it has learned them, at the end.
        side_bias_mps2: Bias of the accelerometer's left axis as it has learned it, at the end, and its σ.
        wheel_readings: Number of readings of the wheels that it has tested.
        reversals: Stretches in which the wheels turn against the course of the fixes.
        misfits: Fields of the mapping that do not fit the log.
        problem: Why it could not be run; empty if it was.
        remarks: Further remarks.
    """

    setup: Setup
    robot: str
    duration_s: float = 0.0
    receiver: Floats = field(default_factory=lambda: np.zeros((0, 6)))
    fixes: Floats = field(default_factory=lambda: np.zeros((0, len(FIX_COLUMNS))))
    track: Floats = field(default_factory=lambda: np.zeros((0, len(TRACK_COLUMNS))))
    poses: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    covariances: Floats = field(default_factory=lambda: np.zeros((0, 3, 3)))
    white: Floats = field(default_factory=lambda: np.zeros((0, len(WHITE_COLUMNS))))
    reference: Floats = field(default_factory=lambda: np.zeros((0, 4)))
    of_antenna: bool = False
    emulated: bool = False
    jumps: list[Jump] = field(default_factory=list)
    starts_s: list[float] = field(default_factory=list)
    contradicted_s: float = 0.0
    strays: int = 0
    stray_most_m: float = 0.0
    wander_most_m_rtm: float = 0.0
    consistency: Consistency = field(default_factory=Consistency)
    fix_lag: int = 1
    constants: tuple[LearnedConstant, ...] = ()
    side_bias_mps2: tuple[float, float] = (0.0, math.inf)
    wheel_readings: int = 0
    reversals: tuple[Span, ...] = ()
    misfits: tuple[str, ...] = ()
    problem: str = ""
    remarks: list[str] = field(default_factory=list)

    @property
    def nis(self) -> Floats:
        """(n,) normalised innovations squared of the fixes: χ² with 2 degrees of freedom, were their errors normal.

        The estimator's own figure is bounded (`estimation/tail.py`); this undoes it.
        """
        weighed = np.minimum(self.fixes[:, 5], FIX_DOF + 2.0 - 1e-9)
        return weighed * (FIX_DOF - 2.0) / (FIX_DOF + 2.0 - weighed)


def run_estimator(
    path: Path, robot: str | None = None, progress: Callable[[float], None] = lambda done: None
) -> EstimatorRun:
    """Run the estimator on a session.

    Args:
        path: The recording.
        robot: Namespace of the robot, if there are several.
        progress: Called with the fraction done.

    Raises:
        RecordingError: The recording cannot be read.
        SpecError: It has no session of that robot, or an unsuitable one.
    """
    inputs = EstimatorInputs(path, robot)
    return run_inputs(inputs, inputs.setup, progress)


def run_inputs(
    inputs: EstimatorInputs, setup: Setup, progress: Callable[[float], None] = lambda done: None
) -> EstimatorRun:
    """Run the estimator of a setup on a session.

    Args:
        inputs: The session.
        setup: Setup of the robot, the session's or another.
        progress: Called with the fraction done.
    """
    try:
        run = rerun(inputs, setup, inputs.frames, progress)
        run.reversals = inputs.reversals
    except NotRebuilt as error:
        run = EstimatorRun(setup, inputs.robot, inputs.last_tick / 100, problem=str(error))
    run.receiver, run.remarks, run.misfits = inputs.receiver(), inputs.remarks, inputs.misfits
    run.reference, run.of_antenna, run.emulated = inputs.reference()
    return run


def rerun(
    inputs: EstimatorInputs,
    setup: Setup,
    frames: FrameSeries,
    progress: Callable[[float], None] = lambda done: None,
    *,
    forgiving: bool = False,
) -> EstimatorRun:
    """Run the estimator of a setup on sensor frames; receiver and reference are left out.

    Args:
        inputs: The session, whose orders count.
        setup: Setup of the robot, the session's or another.
        frames: Sensor frames.
        progress: Called with the fraction done.
        forgiving: Use all fixes, however unlikely, and adapt nothing, so that the results change little with the setup;
            outlying ones count little all the same.
    """
    if forgiving:
        sheet = setup.onboard.gnss.model_copy(update={"jump_fixes": None})
        setup = setup.model_copy(update={"onboard": setup.onboard.model_copy(update={"gnss": sheet})})
    run = EstimatorRun(setup, inputs.robot, inputs.last_tick / 100)
    runner = _Runner(run, inputs, frames)
    if forgiving:
        runner.estimator.ring.figures.fix_doubt_most = math.inf
        runner.estimator.ring.figures.adapts = False
    runner.go(progress)
    return run


class _Runner:
    """Estimator being run, and its log."""

    def __init__(self, run: EstimatorRun, inputs: EstimatorInputs, frames: FrameSeries) -> None:
        self._run, self._inputs, self._frames = run, inputs, frames
        self._ticks = EstimatorTicks(run.setup, frames, _SLICE_TICKS)
        self.estimator = self._ticks.estimator
        self._restart()
        self._fixes: list[Floats] = []
        self._track: list[Floats] = []
        self._counted: Any = FilterCounters.row(1)[0]
        """Counters after the last tick that was noted."""

    def go(self, progress: Callable[[float], None]) -> None:
        """Run all ticks; slices end where something from outside acts on the estimator."""
        run, last, orders = self._run, self._inputs.last_tick, self._inputs.orders
        run.poses = np.full((last + 1, 3), np.nan)
        run.covariances = np.full((last + 1, 3, 3), np.nan)
        run.white = np.full((last + 1, len(WHITE_COLUMNS)), np.nan)
        stops = sorted({tick for tick in orders if 0 < tick <= last} | {last})
        for stop in stops:
            while self._ticks.done < stop:
                self._slice(min(stop - self._ticks.done, _SLICE_TICKS))
                progress(self._ticks.done / last)
            for name, details in orders.get(stop, ()):
                self._obey(stop, name, details)
        run.fixes = np.concatenate(self._fixes or [run.fixes])
        run.track = np.concatenate(self._track or [run.track])
        if self.estimator.started:
            sigmas = self.estimator.position_sigma_m, self.estimator.heading_sigma_rad
            run.constants, run.fix_lag = self.estimator.constants, self.estimator.fix_lag
            learned = self.estimator.ring.learned
            run.side_bias_mps2 = float(learned.side_bias_mps2), math.sqrt(learned.bias_var)
            counters = self.estimator.counters
            run.wheel_readings = counters.encoders
            run.strays, run.stray_most_m = counters.strays, counters.stray_most_m
            run.wander_most_m_rtm = math.sqrt(self.estimator.ring.blind.wander_most * WALK_M2PM)
            run.consistency = report(self.estimator.counters, *sigmas)

    def _slice(self, ticks: int) -> None:
        """Run some ticks, up to the first in which the receiver may have jumped for good."""
        estimator, done = self.estimator, self._ticks.done
        started, state = estimator.started, self._ticks.state
        found = self._ticks.run(ticks)
        may_jump = self._run.setup.onboard.gnss.jump_fixes
        outlying = [] if may_jump is None else np.flatnonzero(found.counters["fixes_outlying_run"] >= may_jump).tolist()
        if outlying and outlying[0] + 1 < len(found.rows) and started:
            self._ticks.go_back(done, state)
            found = self._ticks.run(outlying[0] + 1)
        if not started and estimator.started:
            self._run.starts_s.append(self._ticks.done / 100)
        self._note(found, estimator.accept_lasting_jump() if outlying else None)

    def _note(self, found: EstimatedTicks, jump: AcceptedJump | None) -> None:
        """Log some ticks, at whose end the position may have been moved."""
        run, ticks = self._run, found.first_tick + np.arange(len(found.rows))
        rows, counters = found.rows, found.counters
        if jump is not None:
            run.jumps.append(Jump(self._ticks.done / 100, jump))
            rows[-1, :3] = self.estimator.state[:3]
            rows[-1, SIGMAS:] = self.estimator.position_sigma_m, self.estimator.heading_sigma_rad
        evaluated = counters["fixes"] + counters["fixes_rejected"]
        begun = found.started < len(rows)
        if begun:
            self._note_fixes(found, evaluated)
            since = ticks[found.started :]
            run.poses[since] = rows[found.started :, :3]
            run.covariances[since] = rows[found.started :, COVARIANCE:TWIST_COVARIANCE].reshape(-1, 3, 3)
            for column, name in enumerate(WHITE_COLUMNS):
                run.white[since, column] = counters[name][found.started :]
            run.contradicted_s += 0.01 * int((counters["fix_doubt"][found.started :] >= CONTRADICTED).sum())
            at = np.flatnonzero((ticks % TRACK_TICKS == 0) & (np.arange(len(rows)) >= found.started))
            self._track.append(np.column_stack([ticks[at] / 100, rows[at, :3], rows[at, SIGMAS:]]))
        self._counted = counters[-1].copy()

    def _note_fixes(self, found: EstimatedTicks, evaluated: NDArray[np.int64]) -> None:
        """Log the last fix of each tick with evaluated ones."""
        counters, before = found.counters, self._counted
        at = np.flatnonzero(np.diff(evaluated, prepend=before["fixes"] + before["fixes_rejected"]) > 0)
        at = at[at >= found.started]
        rejected = np.diff(counters["fixes_rejected"], prepend=before["fixes_rejected"])[at]
        fixes = cast("NDArray[Any]", self._frames.fixes)
        fix = fixes[self._frames.arrived[found.first_tick - self._frames.first_tick + at + 1] - 1]
        innovation = counters["innovation_east_m"][at], counters["innovation_north_m"][at]
        columns = (
            fix["stamp_s"],
            fix["east_m"],
            fix["north_m"],
            *innovation,
            counters["fix_nis_last"][at],
            rejected == 0,
        )
        self._fixes.append(np.column_stack(columns).astype(np.float64))

    def _obey(self, tick: int, name: str, details: dict[str, Any]) -> None:
        """Apply an order's effect on the estimator."""
        estimator = self.estimator
        if name == "load" and details.get("taking", "carried") == "carried":
            self._restart()
            self._counted = FilterCounters.row(1)[0]
        elif name == "resume" and estimator.jump_m > 0.0 and (fix := estimator.last_fix) and fix.fix == FIX_FIXED:
            self._run.jumps.append(Jump(tick / 100, estimator.accept_jump()))

    def _restart(self) -> None:
        """Start the estimator anew; odometry alone is told its pose."""
        alone = self._run.setup.vehicle.positioning == ODOMETRY
        self.estimator.restart(self._inputs.first_pose if alone else None)
