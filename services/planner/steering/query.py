"""Input of a path search, in units in which the maximum sharpness is 1."""

from typing import NamedTuple

from touchline.services.planner.geometry.clothoid import Floats


class Query(NamedTuple):
    """A start at the origin, heading along +x, and a goal.

    Attributes:
        ends: (2,) curvatures at the start and at the goal, at most that of the circle.
        goal: Position of the goal.
        turn: Its heading (rad).
        circle: (6,) dimensions of the turning circle, with the maximum curvature (see circles.py).
    """

    ends: Floats
    goal: complex
    turn: float
    circle: Floats
