"""The robot's computer in nominal ticks, compiled: driving along a leg with nothing to decide.

Nearly all ticks of a session are alike: the pose is good, there is no hazard, the robot follows its leg and the valve
does what the plan demands. Such a tick runs the same kernels as `Onboard.step`, on the same arrays. If a tick needs a
decision, `steer` reports it and has changed nothing beyond the results of the estimator and the monitors;
`Onboard.decide` then does the rest of that tick.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.arrays import copy
from touchline.core.jit import kernel
from touchline.onboard import tracking_state as tracking
from touchline.onboard.computer_state import Computer, ReceivedFix
from touchline.onboard.control.path_tracker import STOPPED_MPS, has_arrived, is_held, nozzle_m, observe
from touchline.onboard.drives.onboard_drive import command as drive_command
from touchline.onboard.estimation.filter_tick import take_frame
from touchline.onboard.executive.failsafe import evaluate_safety
from touchline.onboard.executive.geofence import FenceArrays
from touchline.onboard.executive.hazards import NOTHING
from touchline.onboard.executive.localization_monitor import (
    GOOD,
    evaluate_pose,
    has_news_of_itself,
    speaks_against_driving,
    speaks_against_painting,
)
from touchline.onboard.executive.sprayer import Switches, due, switch, wanted_at
from touchline.onboard.interface import TICK_S
from touchline.onboard.protection.way import CLEAR, hold_to_cap, watch_way
from touchline.onboard.trajectory import path_projection as t
from touchline.onboard.trajectory.path import FORWARD
from touchline.onboard.trajectory.path_projection import LegArrays, track
from touchline.schemas.messages import Actuation

Floats = NDArray[np.float64]

DECIDE: Final = -1
"""Returned by `steer` when the tick is not nominal."""
_DISC: Final = int(Actuation.DISC)


class CourseArrays(NamedTuple):
    """Arrays of the loaded trajectory that a nominal tick reads.

    Attributes:
        fence: Fence round the trajectory.
        switches: Actuation along the path.
        leg: Leg that the robot is on.
        sense: Direction of that leg: FORWARD, or BACKWARD, where nothing is sprayed.
        drive: Parameters of the drive.
    """

    fence: FenceArrays
    switches: Switches
    leg: LegArrays
    sense: int
    drive: Any


@kernel
def perceive(tick: int, fixes: Sequence[ReceivedFix], count: int, computer: Computer, course: CourseArrays) -> None:
    """Estimate the pose, and evaluate it and all hazards.

    Args:
        tick: This tick.
        fixes: (n,) fixes that arrived in it.
        count: Number of fixes to use.
        computer: (1,) with the frame, updated.
        course: Gives the fence and the drive.
    """
    take_frame(tick, fixes, count, course.drive, computer)
    evaluate_pose(tick, computer)
    evaluate_safety(tick, computer, course.fence)


@kernel
def steer(computer: Computer, course: CourseArrays, saved: Floats) -> int:
    """Advance along the leg, and fill in the inputs of the follower.

    Args:
        computer: (1,) that has perceived the tick; its leg is updated.
        course: Course that is driven.
        saved: (NOW,) scratch.

    Returns:
        Planned actuation for the coming tick; DECIDE if the tick is not nominal, then nothing is changed.
    """
    c = computer[0]
    if c.safety.emergency != NOTHING or c.safety.stop != NOTHING or speaks_against_driving(computer) != GOOD:
        return DECIDE
    if has_news_of_itself(computer):
        return DECIDE
    if c.way.on:
        watch_way(computer)
        if c.way.blocked != CLEAR:
            return DECIDE
    leg = c.leg
    before = leg.arc_m, leg.piece, leg.entry, leg.speed_mps, leg.reference_m, leg.owed_s
    copy(leg.now, saved)
    leg.back_to_m = 0.0
    observe(course.drive, computer)
    track(computer, course.leg, course.sense, t.MODE_PROFILE)
    place_m, speed_mps, switches = nozzle_m(computer), leg.now[tracking.SPEED], course.switches
    forward = course.sense == FORWARD
    held = is_held(computer)
    forbidden = (
        forward
        and due(switches, computer, place_m, speed_mps)
        and (held or speaks_against_painting(computer, leg.now[tracking.NOZZLE_LATERAL]) != GOOD)
    )
    if forbidden or has_arrived(computer) or (held and abs(leg.speed_mps) < STOPPED_MPS):
        leg.arc_m, leg.piece, leg.entry, leg.speed_mps, leg.reference_m, leg.owed_s = before
        copy(saved, leg.now)
        return DECIDE
    wanted: int = wanted_at(switches, place_m, speed_mps) if forward else 0
    return wanted


@kernel
def actuate(twist: Floats, wanted: int, computer: Computer, course: CourseArrays) -> bool:
    """End a nominal tick.

    Args:
        twist: (2 + actuators,) the follower's answer: speed [m/s], yaw rate [rad/s], and its commands of the actuators;
            nan if the drive is to work them out.
        wanted: Planned actuation, as `steer` returned it.
        computer: (1,) command, valve and clock are updated.
        course: Course that is driven.

    Returns:
        True if the valve is switched.
    """
    c = computer[0]
    command, before = c.command, c.command.valve
    if math.isnan(twist[2]):
        drive_command(course.drive, twist[0], twist[1], c.leg.now, command.actuators)
    else:
        copy(twist[2:], command.actuators)
    if c.way.on:
        hold_to_cap(course.drive, computer, command.actuators)
    if course.sense == FORWARD:
        command.valve_after_s = switch(course.switches, computer, nozzle_m(computer), c.leg.now[tracking.SPEED])
    else:
        command.valve_after_s = 0.0
        c.spray.last_m = nozzle_m(computer)
    command.valve = c.spray.valve
    command.disc = wanted & _DISC != 0
    c.clock.elapsed_s += TICK_S
    switched: bool = command.valve != before
    return switched
