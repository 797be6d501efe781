"""Things that the robot may meet: constants and state for kernels.

Things are numbered: first those that are fixed, then those that move or can be pushed.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.services.robot_sim.world.objects.solids import SolidGrid

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Columns of the state of a mover: a disc that moves or can be pushed.
EAST: Final = 0
NORTH: Final = 1
EAST_MPS: Final = 2
NORTH_MPS: Final = 3
TARGET_EAST: Final = 4
TARGET_NORTH: Final = 5
STAGE: Final = 6  # number of points reached, or of targets drawn
PINNED_EAST: Final = 7  # unit vector away from a fixed thing that it touches; 0 if there is none
PINNED_NORTH: Final = 8
MOVER_COLUMNS: Final = 9

# Columns of its constants.
M_RADIUS: Final = 0
M_HEIGHT: Final = 1
M_DARK: Final = 2
M_SOFT: Final = 3
M_MASS: Final = 4
M_HOLD: Final = 5  # largest acceleration of its own [m/s²]
M_SPEED: Final = 6
M_MOTION: Final = 7
M_START: Final = 8  # tick
M_FIRST: Final = 9  # first of its points
M_POINTS: Final = 10
M_LOOP: Final = 11
M_NEAR: Final = 12
M_AHEAD: Final = 13
M_BEYOND: Final = 14
M_NUMBER: Final = 15  # number of the object in its scenario, which keys its randomness
MOVER_FIGURES: Final = 16

STILL, PATH, WANDER, STEP_IN_FRONT, INTERCEPT = range(5)

# Columns of a fixed thing: bounding disc, radius if it is a disc itself, else 0.
F_EAST: Final = 0
F_NORTH: Final = 1
F_BOUND: Final = 2
F_RADIUS: Final = 3
FIXED_COLUMNS: Final = 4

# Marks of a tick.
NEW_CONTACTS: Final = 0  # number of rows of the log
TOUCHED: Final = 1  # 1 if anything touched the robot
NEAR_FIXED: Final = 2  # number of fixed things, and of movers, within reach
NEAR_MOVERS: Final = 3
PUSHED: Final = 4  # last tick in which something ran into the robot while that was at rest
MARKS: Final = 5

# Columns of the log of contacts.
C_THING: Final = 0
C_EAST: Final = 1
C_NORTH: Final = 2
C_ROBOT_MPS: Final = 3  # speed of the robot's body there
C_CLOSING_MPS: Final = 4
C_ENERGY_J: Final = 5
CONTACT_COLUMNS: Final = 6
MOST_NEW: Final = 16

POSES: Final = 128
"""Length of the ring of poses, in ticks: more than the longest scan takes."""


class Things(NamedTuple):
    """Things around one robot.

    Attributes:
        grid: Edges and discs of fixed things, the soft ones included.
        soft: (solids,) 1 for those of things that the robot and others go through.
        fixed: (n, FIXED_COLUMNS) fixed things that are hard, map frame [m].
        first: (n + 1,) first vertex of each among:
        vertices: (v, 2) corners of outlines, counter-clockwise, map frame [m].
        movers: (m, MOVER_COLUMNS) state of the movers.
        figures: (m, MOVER_FIGURES) constants of the movers.
        points: (p, 2) points of their ways, map frame [m].
        wanted: (m, 2) velocity that each wants in this tick [m/s].
        near: (n + m,) indices of what is within reach of the robot: fixed things first, then movers.
        marks: (MARKS,) counts of this tick, and the tick of the last push.
        clear: (1,) distance that the robot may travel before a fixed thing can be within its reach [m].
        log: (MOST_NEW, CONTACT_COLUMNS) contacts that began in this tick.
        touched: (n + m, 3) tick of each thing's last touch, 1 if the robot moved into it, and tick at which it began.
        outline: (k, 4) corners of the robot, counter-clockwise, and the way along the outline, as the vehicle's file
            gives it, to each and to the next one [m].
        reach_m: Distance of the farthest corner from the robot's origin.
        centre_x_m: Centre of mass ahead of the origin.
        strips: (s, 3) from, to along the outline as given by the vehicle's file [m], and least force [N] of bumper
            strips.
        pressed_n: (s + 1,) mean force on each during the tick, and on the whole outline.
        contacts: (MOST_POINTS, POINT_COLUMNS) scratch of `contacts`.
        motion: (3,) scratch: velocity of the robot's centre of mass, map frame, and yaw rate.
        trail: (POSES, 3) true pose at the end of each of the last ticks, at tick modulo POSES.
    """

    grid: SolidGrid
    soft: Floats
    fixed: Floats
    first: Integers
    vertices: Floats
    movers: Floats
    figures: Floats
    points: Floats
    wanted: Floats
    near: Integers
    marks: Integers
    clear: Floats
    log: Floats
    touched: Integers
    outline: Floats
    reach_m: float
    centre_x_m: float
    strips: Floats
    pressed_n: Floats
    contacts: Floats
    motion: Floats
    trail: Floats
