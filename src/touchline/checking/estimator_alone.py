"""The present estimator on recorded sensors: no world, no follower, and many ticks in one kernel."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.checking.estimator_ticks import COUNTED, EstimatedTicks, EstimatorTicks
from touchline.checking.recorded_session import RecordedSession
from touchline.onboard.estimation.auxiliary_models import AuxiliarySensors
from touchline.onboard.estimation.filter import Estimator
from touchline.onboard.estimation.frame_series import SIGMAS, FrameSeries
from touchline.onboard.estimation.report import report
from touchline.onboard.filter_model import FilterCounters
from touchline.onboard.interface import AuxiliarySample, Checkpoint
from touchline.onboard.trajectory.trajectory import resume_pose
from touchline.schemas import topics
from touchline.schemas.layout import Payloads
from touchline.schemas.topics import Topic
from touchline.services.robot_sim import layouts, tick_log
from touchline.services.robot_sim.odometry_packer import OdometryPacker
from touchline.services.robot_sim.packing import stamp
from touchline.services.robot_sim.tick_log import period

TopicPayloads = tuple[Topic, Payloads]
"""Messages of one topic, in order."""
_AT_ONCE: Final = 6000
"""Ticks per kernel call, so that memory is bounded."""
_ESTIMATOR_TICKS: Final = period(topics.ESTIMATOR)
_NO_SAMPLES: Final[Mapping[int, Sequence[AuxiliarySample]]] = {}
_BEGINNING: Final = Checkpoint(0, 0.0, None)


def estimates_again(
    session: RecordedSession,
    frames: FrameSeries,
    accepted: Collection[int] = (),
    samples: Mapping[int, Sequence[AuxiliarySample]] = _NO_SAMPLES,
) -> Iterator[list[TopicPayloads]]:
    """Yield the present estimator's output on both of its topics.

    Args:
        session: Jobs and orders of the robot.
        frames: Sensor frames of its computer.
        accepted: Ticks at whose ends the position was moved to where the receiver had jumped.
        samples: Measurements of auxiliary sensors, by the tick in which they arrived.
    """
    run = _EstimatorOutput(session, frames, samples)
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


class _EstimatorOutput:
    """An estimator and its output."""

    def __init__(
        self, session: RecordedSession, frames: FrameSeries, samples: Mapping[int, Sequence[AuxiliarySample]]
    ) -> None:
        self._first_tick = frames.first_tick
        self._ticks = EstimatorTicks(session.setup, frames, _AT_ONCE, Estimator)
        if session.initial is not None:
            self._ticks.restore(session.initial)
        self._packer = OdometryPacker(_AT_ONCE)
        self._auxiliary = AuxiliarySensors(session.setup.vehicle, self.estimator)
        self._samples, self._arrivals = samples, deque(sorted(samples))

    @property
    def estimator(self) -> Estimator:
        """The estimator in its present state."""
        return self._ticks.estimator

    def until(self, tick: int) -> Iterator[list[TopicPayloads]]:
        """Run up to the end of a tick."""
        end = tick - self._first_tick + 1
        while self._ticks.done < end:
            next_end = end
            if self._arrivals:
                arrival = self._arrivals[0] - self._first_tick + 1
                if arrival <= self._ticks.done:  # the computer takes them before the next tick
                    self._auxiliary.take(self._samples[self._arrivals.popleft()])
                    continue
                next_end = min(end, arrival)
            yield self._due(self._ticks.run(min(next_end - self._ticks.done, _AT_ONCE)))

    def _due(self, ticks: EstimatedTicks) -> list[TopicPayloads]:
        """Return messages due on both topics."""
        first_tick, n = ticks.first_tick, len(ticks.rows)
        at = np.arange(-first_tick % tick_log.ODOMETRY_TICKS, n, tick_log.ODOMETRY_TICKS)
        rows = np.zeros((len(at), tick_log.READINGS))
        rows[:, tick_log.TICK] = first_tick + at
        rows[:, tick_log.ESTIMATE : tick_log.TRUTH] = ticks.rows[at, :SIGMAS]
        estimates = self._packer.estimates(rows)
        at = np.arange(-first_tick % _ESTIMATOR_TICKS, n, _ESTIMATOR_TICKS)
        return [(topics.ODOMETRY, estimates), (topics.ESTIMATOR, Payloads.of(_consistency(ticks, at)))]


def _consistency(ticks: EstimatedTicks, at: NDArray[np.int64]) -> list[bytes]:
    columns = [ticks.counters[name][at].tolist() for name in COUNTED]
    found = []
    for tick, sigmas, *counted in zip(
        (ticks.first_tick + at).tolist(), ticks.rows[at, SIGMAS:].tolist(), *columns, strict=True
    ):
        counters = FilterCounters(**dict(zip(COUNTED, counted, strict=True)))
        found.append(layouts.ESTIMATOR.pack(*stamp(tick), *report(counters, *sigmas)))
    return found
