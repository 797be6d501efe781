"""Tick of a guided robot, compiled: drives to targets within cells that change while it drives."""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.arcs import unit
from touchline.core.jit import kernel
from touchline.core.timed_motion import motion_at
from touchline.onboard import filter_model as m
from touchline.onboard import tracking_state as tracking
from touchline.onboard.computer_state import Computer
from touchline.onboard.control.cell_steering import HEADING, SPEED, SteeringLimits, X, Y, steer_in_cell
from touchline.onboard.control.path_tracker import observe
from touchline.onboard.control.plan_steering import follow_plan
from touchline.onboard.drives.onboard_drive import command as drive_command
from touchline.onboard.drives.onboard_drive import twist as drive_twist
from touchline.onboard.executive.dead_reckoning import (
    DeadReckoning,
    allowed_way_m,
    must_stand,
    speed_to_rest_within,
)
from touchline.onboard.executive.geofence import FenceArrays
from touchline.onboard.executive.hazards import NOTHING
from touchline.onboard.executive.localization_monitor import GOOD, has_news_of_itself, speaks_against_driving
from touchline.onboard.interface import TICK_S
from touchline.onboard.protection.way import CLEAR, hold_to_cap, watch_way

Floats = NDArray[np.float64]

# Excess of speed from which on turning is given up, and how often half of it is.
_FASTER_MPS: Final = 1e-6
_HALVINGS: Final = 6


class GuidedCourse(NamedTuple):
    """Data that a guided robot drives by until newer guidance arrives.

    Attributes:
        half_planes: (k, 3) of its cell.
        target_m: Target, x + iy.
        until_tick: Tick after which it brakes, because the coordinator has not echoed its messages for too long.
        plan: (m, 5) samples of `timed_motion` that it follows instead of going to the target; none without a plan.
        plan_tick: Tick of the first of them.
        limits: Limits of its motion.
        blind: Limits of driving without fixes.
        lag_s: Time constant of its actuators.
        drive: Parameters of the drive.
        motion: (4,) scratch.
        planned: (5,) scratch.
        fence: Empty fence, for the types of kernels.
    """

    half_planes: Floats
    target_m: complex
    until_tick: int
    plan: Floats
    plan_tick: int
    limits: SteeringLimits
    blind: DeadReckoning
    lag_s: float
    drive: Any
    motion: Floats
    planned: Floats
    fence: FenceArrays


@kernel
def look_ahead(computer: Computer, lag_s: float, motion: Floats) -> None:
    """Predict the place from which the robot moves as commanded, once its actuators have caught up.

    An actuator with a lag τ moves the robot by v·τ more than its commands, whatever they are: the place ahead by that
    moves at the commanded speed.

    Args:
        computer: (1,) that has observed the tick.
        lag_s: τ.
        motion: (4,) of `cell_steering`, filled in.
    """
    c = computer[0]
    x, now = c.filter.states[c.times.tick % m.RING], c.leg.now
    turned = now[tracking.YAW_RATE] * lag_s
    ahead = unit(x[m.HEADING] + 0.5 * turned) * (now[tracking.SPEED] * lag_s)
    motion[X], motion[Y] = x[m.EAST] + ahead.real, x[m.NORTH] + ahead.imag
    motion[HEADING], motion[SPEED] = x[m.HEADING] + turned, c.guidance.speed_mps


@kernel
def _command(drive: Any, speed_mps: float, rate_radps: float, now: Floats, actuators: Floats) -> None:
    """Fill in the commands of a twist; where actuators cannot do both, braking goes before turning.

    Each actuator clips what it cannot do by itself, which may leave a robot that turns nothing to brake with.

    Args:
        drive: Parameters of the drive.
        speed_mps: Speed.
        rate_radps: Yaw rate.
        now: State of the tracking.
        actuators: Filled in.
    """
    drive_command(drive, speed_mps, rate_radps, now, actuators)
    for _ in range(_HALVINGS):
        if drive_twist(drive, actuators, now)[0] <= speed_mps + _FASTER_MPS:
            return
        rate_radps = 0.5 * (rate_radps + now[tracking.YAW_RATE])
        drive_command(drive, speed_mps, rate_radps, now, actuators)


@kernel
def drive_on(computer: Computer, course: GuidedCourse) -> None:
    """Fill in the actuators' commands: towards the target, or braking straight ahead.

    Args:
        computer: (1,) whose estimator has seen the tick; updated.
        course: Present guidance.
    """
    c, motion = computer[0], course.motion
    observe(course.drive, computer)
    look_ahead(computer, course.lag_s, motion)
    rate, guidance, before_mps = 0.0, c.guidance, c.guidance.speed_mps
    follows = len(course.plan) > 0
    if (len(course.half_planes) == 0 and not follows) or c.times.tick > course.until_tick:
        braking_mps2 = max(course.limits.acceleration_mps2, c.leg.brake_mps2)
        guidance.speed_mps = max(guidance.speed_mps - braking_mps2 * TICK_S, 0.0)
        guidance.stands = False
    elif follows:
        motion_at(course.plan, (c.times.tick - course.plan_tick) * TICK_S, course.planned)
        guidance.speed_mps, rate = follow_plan(motion, course.planned, course.limits, TICK_S)
    else:
        guidance.speed_mps, rate, guidance.stands = steer_in_cell(
            motion, guidance.stands, course.half_planes, course.target_m, _limits_now(computer, course), TICK_S
        )
    command = c.command
    if c.way.on:  # braking on the same way is what the cell permits
        guidance.speed_mps = min(guidance.speed_mps, max(c.way.limit_mps, before_mps - c.way.planned_mps2 * TICK_S))
    _command(course.drive, guidance.speed_mps, rate, c.leg.now, command.actuators)
    if c.way.on:
        hold_to_cap(course.drive, computer, command.actuators)
    command.valve, command.disc, command.valve_after_s = False, False, 0.0


@kernel
def _limits_now(computer: Computer, course: GuidedCourse) -> SteeringLimits:
    """Return the limits of motion in a cell: without fixes a speed from which the robot comes to rest in time."""
    way_m, limits = allowed_way_m(computer, course.blind), course.limits
    if math.isinf(way_m):
        return limits
    most_mps = speed_to_rest_within(way_m, limits.acceleration_mps2, course.lag_s)
    return SteeringLimits(
        min(limits.speed_max_mps, most_mps),
        limits.acceleration_mps2,
        limits.lateral_acceleration_mps2,
        limits.yaw_rate_max_radps,
        limits.there_m,
        limits.away_m,
    )


@kernel
def guide(computer: Computer, course: GuidedCourse) -> bool:
    """End a nominal tick of a guided robot.

    Args:
        computer: (1,) that has perceived the tick; updated.
        course: Present guidance.

    Returns:
        True if the tick is nominal; if not, nothing is changed.
    """
    c = computer[0]
    if c.safety.emergency != NOTHING or c.safety.stop != NOTHING or speaks_against_driving(computer) != GOOD:
        return False
    if has_news_of_itself(computer) or must_stand(computer, course.blind):
        return False
    if c.way.on:
        watch_way(computer)
        if c.way.blocked != CLEAR:
            return False
    drive_on(computer, course)
    c.clock.elapsed_s += TICK_S
    return True


@kernel
def stopping_point(computer: Computer, course: GuidedCourse) -> complex:
    """Compute the point where the robot would stand if it braked straight ahead now (m).

    Args:
        computer: (1,) whose estimator has seen the tick.
        course: Present guidance.
    """
    motion = course.motion
    observe(course.drive, computer)
    look_ahead(computer, course.lag_s, motion)
    fastest = max(motion[SPEED], abs(computer[0].leg.now[tracking.SPEED]))
    braking_m = fastest * fastest / (2.0 * course.limits.acceleration_mps2)
    way = unit(motion[HEADING]) * braking_m
    return complex(motion[X] + way.real, motion[Y] + way.imag)
