"""Plots of the computer's decisions on the recorded sensors, beside the recorded ones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from touchline.checking.difference_plots import APART, RECORDED, TODAY, Plot, field_plot, over_time
from touchline.checking.difference_traces import MOST_POINTS, WINDOW_S, BothSides, TimeSeries
from touchline.checking.divergence import Divergence
from touchline.checking.open_loop_computer import OpenLoopComputer
from touchline.checking.recorded_session import RecordedSession

Floats = NDArray[np.float64]
_COLOURS = (APART, RECORDED, TODAY)


def decision_plots(session: RecordedSession, computer: OpenLoopComputer, first: Divergence) -> list[Plot]:
    """Plot the actuator that differs first, around that time, and the differences of all over the whole session.

    Args:
        session: The session, with its recorded commands.
        computer: The computer after it has run the session.
        first: The first difference.
    """
    then = session.commands
    now = np.full_like(then, np.nan)
    for tick, decided in computer.decided.items():
        if tick < len(now):
            now[tick, : len(decided)] = decided
    time_s = np.arange(len(then)) / 100.0
    both = np.isfinite(then).all(axis=1) & np.isfinite(now).all(axis=1)
    found = []
    near = both & (np.abs(time_s - first.time_s) <= WINDOW_S)
    actuators = [f"values[{k}]" for k in range(then.shape[1])]
    if first.field in actuators and near.any():
        k = actuators.index(first.field)
        pair = BothSides(TimeSeries(time_s[near], then[near, k]), TimeSeries(time_s[near], now[near, k]))
        title = f"What differs first: {first.topic} {first.field}"
        found.append(Plot(title, field_plot(pair, first.unit, first.time_s)))
    driven = [k for k in range(len(actuators)) if both.any() and np.abs(now[both, k]).max() > 0.0]
    lines = [
        (_largest(time_s[both], now[both, k] - then[both, k]), _COLOURS[k % len(_COLOURS)], actuators[k])
        for k in driven
    ]
    if lines:
        found.append(Plot("Commands to the actuators, today less recorded", over_time(lines, first.time_s, first.unit)))
    return found


def _largest(time_s: Floats, values: Floats) -> TimeSeries:
    """Return the value farthest from 0 in each of some equal parts of a series, so that no peak is lost."""
    size = -(-len(values) // MOST_POINTS)
    bounds = np.arange(0, len(values), size)
    at = np.array([begin + int(np.abs(values[begin : begin + size]).argmax()) for begin in bounds.tolist()])
    return TimeSeries(time_s[at], values[at])
