"""An estimator on known sensor frames: tick by tick until it starts, then many ticks in one kernel."""

from __future__ import annotations

from typing import Any, Final, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from touchline.checking.recorded_sensors import frame_at
from touchline.checking.recorded_session import NotRebuilt
from touchline.onboard.computer_state import ComputerState
from touchline.onboard.estimation.filter import Estimator
from touchline.onboard.estimation.frame_series import (
    COLUMNS,
    COVARIANCE,
    SIGMAS,
    TWIST_COVARIANCE,
    EstimateSeries,
    FrameSeries,
    estimate_series,
    note_estimate,
)
from touchline.onboard.filter_model import FilterCounters
from touchline.schemas.setup import Setup
from touchline.services.robot_sim.initial_state import DamagedState, InitialState

COUNTED: Final = FilterCounters.dtype.names or ()


class EstimatedTicks(NamedTuple):
    """Estimates after each of n ticks.

    Attributes:
        first_tick: The first of the n.
        rows: (n, COLUMNS) as in `frame_series`; no estimate before `started`. Valid until the next ticks are run.
        counters: (n,) `FilterCounters`, likewise.
        started: The first row with an estimate; n if there is none.
    """

    first_tick: int
    rows: NDArray[np.float64]
    counters: NDArray[Any]
    started: int


class EstimatorTicks:
    """Runner of an estimator on a series of sensor frames.

    Args:
        setup: The robot.
        frames: Sensor frames by tick.
        most: Most ticks per call.
        estimator: Class of the estimator, made of vehicle, configuration and state.

    Attributes:
        estimator: After the last tick that was run.
        frames: The frames; others may be put in their place.
        done: Number of ticks that were run.
    """

    def __init__(self, setup: Setup, frames: FrameSeries, most: int, estimator: type[Estimator] = Estimator) -> None:
        """Allocate for at most `most` ticks."""
        self.frames, self.done = frames, 0
        self._computer = ComputerState.sized(len(setup.vehicle.drive.actuators))()
        self._array = cast("NDArray[Any]", self._computer.array)
        self.estimator = estimator(setup.vehicle, setup.onboard, self._computer)
        self.most = most
        counters = cast("NDArray[Any]", FilterCounters.row(most))
        self._out = EstimateSeries(np.zeros((most, COLUMNS)), cast("Any", counters))
        self._counters = counters

    def restore(self, initial: InitialState) -> None:
        """Begin in the state of a robot at the start of a job.

        Raises:
            NotRebuilt: The state does not fit the present code.
        """
        try:
            initial.restore_estimator(self.estimator, self._computer)
        except DamagedState as error:
            raise NotRebuilt(str(error)) from error

    @property
    def state(self) -> NDArray[Any]:
        """Return a copy of the estimator's state, once it has started."""
        return self._array.copy()

    def go_back(self, done: int, state: NDArray[Any]) -> None:
        """Return to the state after `done` ticks."""
        self.done = done
        self._array[:] = state

    def run(self, ticks: int) -> EstimatedTicks:
        """Run the next ticks, at most `most`; fewer if the estimator starts, up to that tick."""
        frames, begin, end = self.frames, self.done, self.done + ticks
        part = frames._replace(
            first_tick=frames.first_tick + begin,
            readings=frames.readings[begin:end],
            measured=frames.measured[begin:end],
            arrived=frames.arrived[begin : end + 1],
        )
        started = 0
        if self.estimator.started:
            estimate_series(0, ticks, part, self.estimator.drive, self._computer.array, self._out)
        else:
            ticks, started = self._until_it_starts(part, ticks)
        self.done += ticks
        return EstimatedTicks(part.first_tick, self._out.rows[:ticks], self._counters[:ticks], started)

    def _until_it_starts(self, frames: FrameSeries, ticks: int) -> tuple[int, int]:
        """Run until it starts; return how many ticks were run, and the first row with an estimate."""
        for row in range(ticks):
            self.estimator.step(frame_at(frames, row))
            self._note(row)
            if self.estimator.started:
                return row + 1, row
        return ticks, ticks

    def _note(self, row: int) -> None:
        """Fill in a tick that was not run by the kernel."""
        out, estimator = self._out.rows[row], self.estimator
        if estimator.started:
            note_estimate(self._computer.array, out)
        else:
            *out[:COVARIANCE], out[COVARIANCE:TWIST_COVARIANCE], out[TWIST_COVARIANCE:SIGMAS] = estimator.estimate()
            out[SIGMAS:] = 0.0
        for name in COUNTED:
            self._counters[row][name] = getattr(estimator.counters, name)
