"""Patterns of paths with cusps: their elements (see profile.py) and number of cusps."""

import math

import numpy as np

from touchline.core.jit import kernel
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.steering.profile import AMOUNT, DIRECTION, MAX_ELEMENTS, STRAIGHT, UNKNOWN

QUARTER = 0.5 * math.pi


def elements_of(kinds: str, directions: str) -> Floats:
    """Elements (MAX_ELEMENTS, 4) of a pattern; the amounts of fixed bends are still 0.

    Kinds are B: bend, S: straight, Q: bend by a quarter turn, which is fixed, Z: straight without length, towards which
    curvature goes to zero. Of four bends the inner two share one unknown with opposite signs.
    """
    elements = np.zeros((MAX_ELEMENTS, 4))
    unknown = 0
    for i, kind in enumerate(kinds):
        elements[i, STRAIGHT] = kind in "SZ"
        elements[i, DIRECTION] = 1.0 if directions[i] == "+" else -1.0
        elements[i, UNKNOWN], elements[i, AMOUNT] = (-1, 0.0) if kind in "QZ" else (unknown, 1.0)
        if "BBBB" in kinds and i == kinds.index("B") + 2:
            elements[i, UNKNOWN], elements[i, AMOUNT] = 1, -1.0
        elif kind not in "QZ":
            unknown += 1
    return elements


def cusps_of(directions: str) -> int:
    """Number of cusps of a pattern between forward motion before and after it."""
    around = f"+{directions}+"
    return around.count("+-") + around.count("-+")


@kernel
def ramps_beside(elements: Floats, i: int) -> int:
    """Number of clothoids beside an element: one towards each neighbour that is driven in its direction.

    Args:
        elements: (n, 4) see profile.py; before the first and after the last the robot drives forward.
        i: Index of the element.
    """
    before = elements[i - 1, DIRECTION] if i > 0 else 1.0
    after = elements[i + 1, DIRECTION] if i + 1 < len(elements) else 1.0
    return int(before == elements[i, DIRECTION]) + int(after == elements[i, DIRECTION])


@kernel
def bend_amount(deflection: float, ramps: int, limit: float) -> float:
    """Amount of a bend, as if its clothoids led from and to straights.

    Args:
        deflection: Angle by which it turns, left positive (rad).
        ramps: Number of its clothoids: 0, 1 or 2.
        limit: Maximum curvature.
    """
    size, spirals = abs(deflection), 0.5 * ramps * limit * limit
    if ramps == 0:
        amount = size / limit
    elif size < spirals:
        amount = math.sqrt(2.0 * size / ramps)
    else:
        amount = limit + (size - spirals) / (ramps * limit)
    return math.copysign(amount, deflection)
