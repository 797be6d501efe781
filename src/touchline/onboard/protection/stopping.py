"""StopFigures: how far and how long a robot moves until rest, and the speed from which it rests in time.

The manoeuvre is to hold the speed for the reaction time T, in which the actuators' lag is contained, then to brake at b
to rest, and last to creep: actuators with a lag τ approach rest exponentially, so what remains of the speed where the
braking falls below b takes τ·ln(b·τ / CREPT_MPS) to fade.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from touchline.core.jit import kernel
from touchline.onboard.interface import TICK_S

CREPT_MPS: Final = 0.02
"""Speed below which the robot counts as at rest."""


class StopFigures(NamedTuple):
    """Figures of a stop.

    Attributes:
        reaction_s: T.
        braking_mps2: b.
        creep_s: Time of the last creep.
        fading_mps: Speed b·τ at which it begins.
    """

    reaction_s: float
    braking_mps2: float
    creep_s: float
    fading_mps: float


def stopping_with(braking_mps2: float, lag_s: float) -> StopFigures:
    """Return the figures of a stop.

    The reaction takes this tick, the next one, and the lag.

    Args:
        braking_mps2: Deceleration b.
        lag_s: Time constant τ of the actuators.
    """
    creep_s = lag_s * math.log(max(braking_mps2 * lag_s / CREPT_MPS, 1.0))
    return StopFigures(2.0 * TICK_S + lag_s, braking_mps2, creep_s, braking_mps2 * lag_s)


@kernel
def stopping_m(speed_mps: float, stopping: StopFigures) -> float:
    """Return the distance to rest [m]: v·T + v² / 2b.

    Args:
        speed_mps: Speed v.
        stopping: Figures of the stop.
    """
    distance_m: float = speed_mps * (stopping.reaction_s + 0.5 * speed_mps / stopping.braking_mps2)
    return distance_m


@kernel
def speed_to_stop_in(distance_m: float, stopping: StopFigures) -> float:
    """Return the speed [m/s] whose stopping distance this is: the inverse of `stopping_m`.

    Args:
        distance_m: Distance; nothing can stop in one that is not positive.
        stopping: Figures of the stop.
    """
    if distance_m <= 0.0:
        return 0.0
    reached = stopping.braking_mps2 * stopping.reaction_s
    return math.sqrt(reached * reached + 2.0 * stopping.braking_mps2 * distance_m) - reached


@kernel
def latest_at(distance_m: float, speed_mps: float, stopping: StopFigures) -> float:
    """Return the latest time [s] at which the robot, still moving, may be at a place, whenever it begins to brake.

    It comes there latest if it brakes at once; where it would then have stopped, or creeps, that is the time to rest.

    Args:
        distance_m: Distance of the place, at least 0.
        speed_mps: Speed at which it begins to stop, above 0.
        stopping: Figures of the stop.
    """
    b = stopping.braking_mps2
    left = speed_mps * speed_mps - 2.0 * b * distance_m
    if left <= stopping.fading_mps * stopping.fading_mps:
        return stopping.reaction_s + speed_mps / b + stopping.creep_s
    return 2.0 * TICK_S + (speed_mps - math.sqrt(left)) / b
