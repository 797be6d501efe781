"""Start and end of a tick for the things around the robot."""

from __future__ import annotations

from collections.abc import Sequence

from touchline.core.jit import borrowing
from touchline.services.robot_sim.world.body import BodyState
from touchline.services.robot_sim.world.objects.contacts import look_round
from touchline.services.robot_sim.world.objects.moving import choose_velocities, settle_collisions
from touchline.services.robot_sim.world.objects.things import NEAR_FIXED, NEAR_MOVERS, POSES, TOUCHED, Things


@borrowing
def begin_things(things: Things, states: Sequence[BodyState], seed: int, tick: int) -> bool:
    """Begin a tick; return True if anything is within reach of the robot.

    Args:
        things: Movers, marks and the list of what is near are updated.
        states: (1,) true state of the robot's body.
        seed: Seed of the scenario.
        tick: Tick that begins.
    """
    if len(things.touched) == 0:
        return False
    choose_velocities(things, states, seed, tick)
    look_round(things, states[0])
    met: bool = things.marks[NEAR_FIXED] + things.marks[NEAR_MOVERS] > 0
    return met


@borrowing
def end_things(things: Things, state: BodyState, tick: int) -> None:
    """End a tick: keep things apart, and note the robot's pose and whether its bumper is pressed.

    Args:
        things: Movers and the trail are updated.
        state: State of the robot's body; its bumper is updated.
        tick: Tick that ends.
    """
    pose = things.trail[tick % POSES]
    pose[0], pose[1], pose[2] = state.east_m, state.north_m, state.heading_rad
    state.bumper = False
    if len(things.touched) == 0:
        return
    settle_collisions(things)
    if things.marks[TOUCHED] == 0:
        return
    strips = len(things.strips)
    state.bumper = strips == 0 and things.pressed_n[0] > 0.0
    for strip in range(strips):
        if things.pressed_n[strip] >= things.strips[strip, 2]:
            state.bumper = True
