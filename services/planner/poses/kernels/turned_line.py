"""Compiled: duration of a drive by turn on the spot, line, and turn on the spot."""

import cmath
import math

from touchline.core.angles import wrapped
from touchline.core.jit import kernel
from touchline.services.planner.drives.caps import spin_time
from touchline.services.planner.poses.kernels.cubic_curve import FINE, Terms, cubic_curve, price


@kernel
def turned_line_s(goal: complex, turn: float, backward: bool, terms: Terms) -> float:
    """Seconds from the origin, heading along +x, by turn, line and turn; the line is priced like a curve.

    Args:
        goal: x + iy (m), not the origin.
        turn: Heading there (rad).
        backward: Whether the line may be driven backward, if that is quicker.
        terms: Constraints of the drive.
    """
    length = complex(abs(goal), 0.0)
    line_s = price(cubic_curve(0j, length, length, length), terms, FINE)
    first = cmath.phase(goal)
    spins_s = _spins_s(first, turn, terms)
    if backward:
        spins_s = min(spins_s, _spins_s(first + math.pi, turn, terms))
    return float(line_s + spins_s)


@kernel
def _spins_s(first: float, turn: float, terms: Terms) -> float:
    """Seconds to turn from heading 0 (rad) to the line's and from there to the goal's."""
    seconds = 0.0
    for angle in (first, turn - first):
        by = abs(wrapped(angle))
        if by > 0.0:
            seconds += spin_time(by, terms.limits)
    return seconds
