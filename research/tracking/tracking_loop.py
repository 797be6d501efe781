"""Closed loop for tracking laws: a unicycle, ideal or disturbed, and a timed reference."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.onboard.control.timed.tracking_law import (
    LAW_MEMORY,
    TrackingErrors,
    Wanted,
    steer,
)
from touchline.onboard.trajectory.timed_reference import errors_against

Floats = NDArray[np.float64]
Pose = tuple[float, float, float]
Twist = tuple[float, float]
Steer = Callable[[TrackingErrors, Wanted], Twist]

STEP_S = 0.02
SUBSTEPS = 4
"""Steps of the robot per control step; with the midpoint rule the path is exact to a hundredth of a millimetre."""


class TimedReference(NamedTuple):
    """Reference, sampled every STEP_S.

    Attributes:
        poses: (n, 3) x, y [m] and heading [rad, unwrapped].
        speed_mps: (n,) forward speed.
        yaw_rate_radps: (n,) yaw rate.
        acceleration_mps2: (n,) derivative of the speed.
    """

    poses: Floats
    speed_mps: Floats
    yaw_rate_radps: Floats
    acceleration_mps2: Floats


class Disturbances(NamedTuple):
    """Disturbances of the robot and its measurements; none by default.

    Attributes:
        lag_s: Time constant of the actuators.
        speed_gain: Ratio of true to commanded speed.
        yaw_rate_gain: Ratio of true to commanded yaw rate.
        position_m: White noise of the measured position, 1 σ per axis.
        heading_rad: White noise of the measured heading, 1 σ.
        most: Maximum speed [m/s] and yaw rate [rad/s]; commands are scaled down together.
    """

    lag_s: float = 0.0
    speed_gain: float = 1.0
    yaw_rate_gain: float = 1.0
    position_m: float = 0.0
    heading_rad: float = 0.0
    most: tuple[float, float] = (np.inf, np.inf)


IDEAL = Disturbances()
STUDIED = Disturbances(0.1, 0.98, 1.03, 0.005, float(np.radians(0.3)), (0.26, 1.82))
"""Disturbances for the comparison of trackers, on a TurtleBot3 Waffle Pi."""


class Tracked(NamedTuple):
    """Record of a run of the loop.

    Attributes:
        errors: (n, 3) true e₁, e₂ [m] and e₃ [rad] at each step.
        commands: (n, 2) commanded speed [m/s] and yaw rate [rad/s].
    """

    errors: Floats
    commands: Floats

    @property
    def distance_m(self) -> Floats:
        """Distances (n,) from the reference."""
        return np.asarray(np.hypot(self.errors[:, 0], self.errors[:, 1]))


def driven_reference(speed_mps: Floats, yaw_rate_radps: Floats) -> Floats:
    """Integrate poses (n, 3) from the origin by speeds and yaw rates (n,), with Simpson's rule between samples."""
    heading = np.concatenate(([0.0], np.cumsum(0.5 * STEP_S * (yaw_rate_radps[1:] + yaw_rate_radps[:-1]))))
    turned = 0.125 * STEP_S * (yaw_rate_radps[:-1] - yaw_rate_radps[1:])
    middle, pace = 0.5 * (heading[1:] + heading[:-1]) + turned, 0.5 * (speed_mps[1:] + speed_mps[:-1])
    poses = np.empty((len(heading), 3))
    poses[0, :2], poses[:, 2] = 0.0, heading
    for axis, part in enumerate((np.cos, np.sin)):
        rates = speed_mps * part(heading)
        steps = STEP_S / 6.0 * (rates[:-1] + 4.0 * pace * part(middle) + rates[1:])
        poses[1:, axis] = np.cumsum(steps)
    return poses


def reference_of(
    speed: Callable[[Floats], Floats], yaw_rate: Callable[[Floats], Floats], duration_s: float
) -> TimedReference:
    """Create the reference of a speed [m/s] and a yaw rate [rad/s], both functions of the time [s]."""
    t: Floats = np.arange(round(duration_s / STEP_S) + 1, dtype=np.float64) * STEP_S
    v, w = speed(t), yaw_rate(t)
    change = np.diff(v) / STEP_S
    acceleration = 0.5 * (np.append(change, change[-1]) + np.append(change[0], change))
    return TimedReference(driven_reference(v, w), v, w, acceleration)


def by_law(law: Any) -> Steer:
    """Create the steering function of a tracking law at the start of a motion."""
    memory = np.zeros(LAW_MEMORY)

    def steered(errors: TrackingErrors, wanted: Wanted) -> tuple[float, float]:
        speed, yaw_rate = steer(law, errors, wanted, memory)
        return speed, yaw_rate

    return steered


def track_reference(
    steered: Steer,
    reference: TimedReference,
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0),
    disturbances: Disturbances = IDEAL,
    seed: int = 0,
) -> Tracked:
    """Simulate a unicycle that tracks a reference.

    Args:
        steered: Tracker.
        reference: Reference to track.
        offset: Initial error in the frame of the reference: forward and left [m], heading [rad].
        disturbances: Disturbances of robot and measurements.
        seed: Seed of the noise.
    """
    count = len(reference.poses)
    noise = np.random.default_rng(seed).normal(size=(count, 3))
    noise *= [disturbances.position_m, disturbances.position_m, disturbances.heading_rad]
    x, y, heading = reference.poses[0].tolist()
    cos, sin = math.cos(heading), math.sin(heading)
    pose = (x + cos * offset[0] - sin * offset[1], y + sin * offset[0] + cos * offset[1], heading + offset[2])
    twist = float(reference.speed_mps[0]), float(reference.yaw_rate_radps[0])
    errors, commands = np.empty((count, 3)), np.empty((count, 2))
    motions = np.column_stack((reference.speed_mps, reference.yaw_rate_radps, reference.acceleration_mps2)).tolist()
    for i, (there, motion, off) in enumerate(zip(reference.poses.tolist(), motions, noise.tolist(), strict=True)):
        errors[i] = errors_against(pose, tuple(there))
        seen = pose[0] + off[0], pose[1] + off[1], pose[2] + off[2]
        command = steered(TrackingErrors(*errors_against(seen, tuple(there))), Wanted(*motion))
        commands[i] = command
        pose, twist = _moved(pose, twist, command, disturbances)
    return Tracked(errors, commands)


def _moved(pose: Pose, twist: Twist, command: Twist, disturbances: Disturbances) -> tuple[Pose, Twist]:
    """Pose and twist after a step under a command."""
    excess = max(1.0, abs(command[0]) / disturbances.most[0], abs(command[1]) / disturbances.most[1])
    speed = command[0] / excess * disturbances.speed_gain
    yaw_rate = command[1] / excess * disturbances.yaw_rate_gain
    h = STEP_S / SUBSTEPS
    stay = math.exp(-h / disturbances.lag_s) if disturbances.lag_s > 0.0 else 0.0
    x, y, heading = pose
    v, w = twist if stay > 0.0 else (speed, yaw_rate)
    for _ in range(SUBSTEPS):
        v_after, w_after = speed + stay * (v - speed), yaw_rate + stay * (w - yaw_rate)
        mean, turn = 0.5 * (v + v_after), 0.5 * (w + w_after)
        middle = heading + 0.5 * turn * h
        x, y, heading = x + mean * h * math.cos(middle), y + mean * h * math.sin(middle), heading + turn * h
        v, w = v_after, w_after
    return (x, y, heading), (v, w)
