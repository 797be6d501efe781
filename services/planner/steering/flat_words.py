"""Words with cusps that are paths already, although turns between straights do not reach the curvature limit.

Such a turn is the flatter pair of clothoids on the turning circle (see `circles.turn_length`). Newton's method uses
clothoids of full sharpness only: a turn of these is shorter, but ends elsewhere, which may lengthen the rest of the
path by more than that.
"""

import math

from touchline.core.jit import kernel
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.steering.circles import LIMIT
from touchline.services.planner.steering.construct import put, put_ramp, put_turn
from touchline.services.planner.steering.patterns import ramps_beside
from touchline.services.planner.steering.profile import AMOUNT, DIRECTION, STRAIGHT, UNKNOWN


@kernel
def flat_pieces(elements: Floats, u: Floats, ends: Floats, c: Floats, pieces: Floats) -> int:
    """Fill in the pieces of a word with flat turns; return their number, 0 if there is no such path.

    There is none where a bend beside a cusp or beside a curved end does not reach the limit.

    Args:
        elements: (n, 4) elements of the word, filled in by `cusp_words.word`.
        u: (3,) unknowns.
        ends: (2,) curvatures at the start and at the goal.
        c: (6,) dimensions of the turning circle.
        pieces: (MAX_PIECES, 4) filled in.
    """
    if not _has_flat_turns(elements, u, ends, c[LIMIT]):
        return 0
    n = 0
    for i in range(len(elements)):
        direction, amount = elements[i, DIRECTION], _amount(elements, u, i)
        side = math.copysign(1.0, amount)
        ramps = ramps_beside(elements, i)
        if elements[i, STRAIGHT] != 0.0:
            n = put(pieces, n, amount, 0.0, 0.0, direction)
        elif ramps == 2 and abs(amount) < c[LIMIT]:
            n = put_turn(pieces, n, amount * abs(amount), direction, c)
        else:
            k = side * c[LIMIT]
            hold = abs(amount) if ramps == 0 else ramps * (abs(amount) - c[LIMIT])
            if (elements[i - 1, DIRECTION] if i > 0 else 1.0) == direction:
                n = put_ramp(pieces, n, 0.0 if i > 0 else ends[0], k, direction)
            n = put(pieces, n, hold, k, 0.0, direction)
            if (elements[i + 1, DIRECTION] if i + 1 < len(elements) else 1.0) == direction:
                n = put_ramp(pieces, n, k, 0.0 if i + 1 < len(elements) else ends[1], direction)
    return n


@kernel
def _has_flat_turns(elements: Floats, u: Floats, ends: Floats, limit: float) -> bool:
    """True if there are bends that do not reach the limit, all of them between straights."""
    n, flat = len(elements), False
    for i in range(n):
        ramps = ramps_beside(elements, i)
        if elements[i, STRAIGHT] != 0.0 or ramps == 0 or abs(_amount(elements, u, i)) >= limit:
            continue
        straight = (i > 0 or ends[0] == 0.0) and (i + 1 < n or ends[1] == 0.0)
        if ramps < 2 or not straight:
            return False
        flat = True
    return flat


@kernel
def _amount(elements: Floats, u: Floats, i: int) -> float:
    which = int(elements[i, UNKNOWN])
    amount: float = elements[i, AMOUNT] * (u[which] if which >= 0 else 1.0)
    return amount
