"""Today's estimator on recorded sensors: no world, no follower, and many ticks in one kernel."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from types import SimpleNamespace
from typing import Any, Final, cast

import numpy as np
from numpy.typing import NDArray

from touchline.schemas import topics
from touchline.schemas.layout import Payloads
from touchline.schemas.setup import Setup
from touchline.schemas.topics import Topic
from touchline.services.onboard.computer_state import ComputerState
from touchline.services.onboard.estimation.filter import Estimator
from touchline.services.onboard.estimation.frame_series import (
    COLUMNS,
    COVARIANCE,
    SIGMAS,
    TWIST_COVARIANCE,
    EstimateSeries,
    FrameSeries,
    estimate_series,
    note_estimate,
)
from touchline.services.onboard.estimation.report import report
from touchline.services.onboard.filter_model import FilterCounters
from touchline.services.onboard.interface import Checkpoint
from touchline.services.onboard.trajectory.trajectory import resume_pose
from touchline.services.robot_sim import layouts, tick_log
from touchline.services.robot_sim.odometry_packer import OdometryPacker
from touchline.services.robot_sim.packing import stamp
from touchline.services.robot_sim.tick_log import period
from touchline.services.runs.checking.recorded_sensors import frame_at
from touchline.services.runs.checking.recorded_session import RecordedSession

Said = tuple[Topic, Payloads]
"""Some messages of a topic, in their order."""
_AT_ONCE: Final = 6000
"""Ticks, so that memory is bounded."""
_ESTIMATOR_TICKS: Final = period(topics.ESTIMATOR)
_COUNTED: Final = FilterCounters.dtype.names or ()
_BEGINNING: Final = Checkpoint(0, 0.0, None)


def estimates_again(
    session: RecordedSession, frames: FrameSeries, accepted: Collection[int] = ()
) -> Iterator[list[Said]]:
    """What today's estimator says of itself and of where the robot is, on both of its topics.

    Args:
        session: When the robot was carried to a start, and told to go on.
        frames: That its computer got.
        accepted: Ticks at whose ends the position was moved to where the receiver had jumped.
    """
    run = _EstimatorRun(session.setup, frames)
    jobs = iter(session.jobs)
    for order in session.orders:
        yield from run.until(order.tick)
        if order.name == "load":
            job = next(jobs)
            if order.details.get("taking", "carried") == "carried":
                run.estimator.restart(resume_pose(job.trajectory, session.setup.vehicle, _BEGINNING))
        elif order.name == "resume" and order.tick in accepted:
            run.estimator.accept_jump()
    yield from run.until(session.last_tick)


class _EstimatorRun:
    """An estimator, tick by tick until it has started, and then as many as there are."""

    def __init__(self, setup: Setup, frames: FrameSeries) -> None:
        self._frames, self._computer, self._done = frames, ComputerState(), 0
        self.estimator = Estimator(setup.vehicle, setup.onboard, self._computer)
        counters = cast("NDArray[Any]", FilterCounters.row(_AT_ONCE))
        self._out = EstimateSeries(np.zeros((_AT_ONCE, COLUMNS)), cast("Any", counters))
        self._counters = counters
        self._packer = OdometryPacker(_AT_ONCE)

    def until(self, tick: int) -> Iterator[list[Said]]:
        """Run up to the end of a tick."""
        end = tick - self._frames.first_tick + 1
        while self._done < end:
            begin, self._done = self._done, min(end, self._done + _AT_ONCE)
            yield self._run(begin, self._done)

    def _run(self, begin: int, end: int) -> list[Said]:
        frames, n = self._frames, end - begin
        part = frames._replace(
            first_tick=frames.first_tick + begin,
            readings=frames.readings[begin:end],
            measured=frames.measured[begin:end],
            arrived=frames.arrived[begin : end + 1],
        )
        row = 0
        while row < n and not self.estimator.started:
            self.estimator.step(frame_at(part, row))
            self._note(row)
            row += 1
        estimate_series(row, n, part, self.estimator.drive, self._computer.array, self._out)
        return self._said(part.first_tick, n)

    def _note(self, row: int) -> None:
        """Fill in a tick that was not run by the kernel."""
        out, estimator = self._out.rows[row], self.estimator
        if estimator.started:
            note_estimate(self._computer.array, out)
        else:
            *out[:COVARIANCE], out[COVARIANCE:TWIST_COVARIANCE], out[TWIST_COVARIANCE:SIGMAS] = estimator.estimate()
            out[SIGMAS:] = 0.0
        for name in _COUNTED:
            self._counters[row][name] = getattr(estimator.counters, name)

    def _said(self, first_tick: int, n: int) -> list[Said]:
        """What of n ticks is due on both topics."""
        at = np.arange(-first_tick % tick_log.ODOMETRY_TICKS, n, tick_log.ODOMETRY_TICKS)
        rows = np.zeros((len(at), tick_log.COLUMNS))
        rows[:, tick_log.TICK] = first_tick + at
        rows[:, tick_log.ESTIMATE : tick_log.TRUTH] = self._out.rows[at, :SIGMAS]
        estimates = self._packer.estimates(rows)
        at = np.arange(-first_tick % _ESTIMATOR_TICKS, n, _ESTIMATOR_TICKS)
        return [(topics.ODOMETRY, estimates), (topics.ESTIMATOR, Payloads.of(self._consistency(first_tick, at)))]

    def _consistency(self, first_tick: int, at: NDArray[np.int64]) -> list[bytes]:
        columns = [self._counters[name][at].tolist() for name in _COUNTED]
        found = []
        for tick, sigmas, *counted in zip(
            (first_tick + at).tolist(), self._out.rows[at, SIGMAS:].tolist(), *columns, strict=True
        ):
            counters = cast("FilterCounters", SimpleNamespace(**dict(zip(_COUNTED, counted, strict=True))))
            found.append(layouts.ESTIMATOR.pack(*stamp(tick), *report(counters, *sigmas)))
        return found
