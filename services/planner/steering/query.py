"""The input of a path search, in units in which the largest sharpness is 1."""

from typing import NamedTuple

from touchline.services.planner.geometry.clothoid import Floats


class Query(NamedTuple):
    """A start at the origin, heading along +x, and a goal.

    Attributes:
        ends: (2,) curvatures at the start and at the goal, at most that of the circle.
        goal: Where the goal lies.
        turn: Its heading (rad).
        circle: (6,) figures of the turning circle, which hold the largest curvature (see circles.py).
    """

    ends: Floats
    goal: complex
    turn: float
    circle: Floats
