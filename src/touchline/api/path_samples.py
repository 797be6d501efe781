"""Samples of a planned trajectory: poses, times and speeds along it, and its segments."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from touchline.jobs.shared.timed_path import times_s
from touchline.onboard.trajectory.path import poses_along
from touchline.onboard.trajectory.profiles import speed_at
from touchline.onboard.trajectory.trajectory import LoadedTrajectory
from touchline.onboard.trajectory.turn import TurnInPlace
from touchline.schemas.messages import Actuation

SPIN_SAMPLES = 21
PATH = np.dtype(
    [
        ("time_s", np.float64),
        ("station_m", np.float64),
        ("x_m", np.float64),
        ("y_m", np.float64),
        ("heading_rad", np.float64),
        ("speed_mps", np.float64),
        ("curvature_1pm", np.float64),
        ("segment", np.int64),
        ("working", np.bool_),
    ]
)
SEGMENTS = np.dtype(
    [
        ("id", "U64"),
        ("start_m", np.float64),
        ("end_m", np.float64),
        ("start_s", np.float64),
        ("end_s", np.float64),
        ("curvature_1pm", np.float64),
        ("direction", np.int64),
        ("turn_rad", np.float64),
        ("working", np.bool_),
    ]
)
# Columns of a row of `LoadedTrajectory.path`.
HEADING, CURVATURE, LENGTH, ARC, SENSE = 2, 3, 4, 5, 6


def path_samples(plan: LoadedTrajectory, step_m: float) -> NDArray[np.void]:
    """Poses of the robot's origin along a trajectory, map frame, in the order of time.

    Args:
        plan: The trajectory.
        step_m: Largest distance between two samples.

    Returns:
        (n,) of `PATH`; the speed is negative when driving backward, the curvature that of the robot's path, left
        positive; `segment` is an index of `segment_table`.
    """
    turned = {plan.legs[leg].first: turn for leg, turn in plan.turns.items()}
    parts = []
    for index, row in enumerate(plan.path):
        if index in turned:
            turn = turned[index]
            since_s = np.linspace(0.0, turn.time_s, SPIN_SAMPLES)
            part = np.zeros(SPIN_SAMPLES, PATH)
            part["x_m"], part["y_m"] = row[:2]
            part["heading_rad"] = row[HEADING] + turned_rad(turn, since_s)
            part["station_m"] = row[ARC]
            part["time_s"] = times_s(plan, part["station_m"]) - turn.time_s + since_s
        else:
            along = np.linspace(0.0, row[LENGTH], 2 + int(row[LENGTH] / step_m))
            poses = poses_along(np.tile(row, (len(along), 1)), along)
            part = np.zeros(len(along), PATH)
            part["x_m"], part["y_m"], part["heading_rad"] = poses.T
            part["station_m"], part["curvature_1pm"] = row[ARC] + along, row[SENSE] * row[CURVATURE]
            part["time_s"] = times_s(plan, part["station_m"])
            part["time_s"][-1] -= turned[index + 1].time_s if index + 1 in turned else 0.0
            part["speed_mps"] = row[SENSE] * speed_at(plan.speeds, part["station_m"])
        part["segment"] = index
        parts.append(part)
    found = np.concatenate(parts)
    found["working"] = working_at(plan, found["station_m"])
    found["heading_rad"] = np.remainder(found["heading_rad"] + np.pi, 2.0 * np.pi) - np.pi
    return found[np.argsort(found["time_s"], kind="stable")]


def turned_rad(turn: TurnInPlace, since_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angle of a turn on the spot so far: even acceleration, a constant rate if it gets so fast, even deceleration.

    Args:
        turn: The turn.
        since_s: (n,) time since its begin.
    """
    size, gain = abs(turn.angle_rad), turn.acceleration_radps2
    rate = min(turn.rate_radps, np.sqrt(gain * size))
    left_s, ramp_s = turn.time_s - since_s, rate / gain
    steady = rate * (since_s - 0.5 * ramp_s)
    so_far = np.where(since_s < ramp_s, 0.5 * gain * since_s**2, steady)
    return np.copysign(np.where(left_s < ramp_s, size - 0.5 * gain * left_s**2, so_far), turn.angle_rad)


def working_at(plan: LoadedTrajectory, station_m: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Flags (n,) of arc lengths (n,): true where the plan sprays."""
    masks = np.array([0, *plan.actuation])
    return np.asarray((masks[np.searchsorted(plan.switch_m, station_m, side="right")] & Actuation.VALVE) != 0)


def segment_table(plan: LoadedTrajectory) -> NDArray[np.void]:
    """Segments of a trajectory in driving order.

    Returns:
        (n,) of `SEGMENTS`: arc lengths and times of begin and end; direction 1 forward, −1 backward, 0 on the spot.
    """
    table = np.zeros(len(plan.path), SEGMENTS)
    start_m, end_m = plan.path[:, ARC], plan.path[:, ARC] + plan.path[:, LENGTH]
    table["id"], table["start_m"], table["end_m"] = plan.ids, start_m, end_m
    table["direction"], table["curvature_1pm"] = plan.path[:, SENSE], plan.path[:, SENSE] * plan.path[:, CURVATURE]
    table["end_s"] = times_s(plan, end_m)
    for leg, turn in plan.turns.items():
        first = plan.legs[leg].first
        table["turn_rad"][first] = turn.angle_rad
        if first:
            table["end_s"][first - 1] -= turn.time_s
    table["start_s"][1:] = table["end_s"][:-1]
    table["working"] = working_at(plan, 0.5 * (start_m + end_m))
    return table
