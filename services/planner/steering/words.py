"""The six Dubins words (LSL RSR LSR RSL LRL RLR) for any kind of turn, and the straight line and the single turn.

Dubins, "On curves of minimal length with a constraint on average curvature, and with prescribed initial and terminal
positions and tangents", American Journal of Mathematics 79(3), 1957. `circles.py` has the same compiled.

Every word is found from the turning centres alone, in the frame of the start pose, with points as complex numbers.
Words that begin to the right are the mirror image of those that begin to the left.
Validity (centre distance d, turning circle radius R, Ω_x the forward part of the centre): LSL needs d ≥ 2Ω_x,
LSR d ≥ 2R, LRL d ≤ 4R. As Ω_x < R, LSL or LRL always exists, so the set is complete.
"""

import cmath
import math
from collections.abc import Iterator
from typing import NamedTuple

from touchline.core.angles import TAU
from touchline.core.plain_sum import plain_sum
from touchline.services.planner.geometry.clothoid import PathPose, Piece, joined
from touchline.services.planner.steering.turns import Turn

# Deflections this close below a full turn are a zero turn blurred by rounding, not a full circle.
WRAP_RAD = 1e-12
# A goal this close to the straight ahead, or to the end of a single turn, is on it.
ON_PATH = 1e-12
# A word must be this much shorter to replace one earlier in the list, so that ties do not depend on rounding.
TIE_M = 1e-9

_MIRROR = str.maketrans("LR", "RL")


class Word(NamedTuple):
    """Letters (L, R, S) and, for each, the deflection (rad, ≥ 0) of the turn or the length (m) of the straight."""

    letters: str
    amounts: tuple[float, ...]

    def length(self, turn: Turn) -> float:
        """Length of the whole word (m)."""
        return plain_sum(a if c == "S" else turn.length(a) for c, a in zip(self.letters, self.amounts, strict=True))

    def pieces(self, turn: Turn) -> tuple[Piece, ...]:
        """Pieces of the word, in driving order."""
        pieces: list[Piece] = []
        for letter, amount in zip(self.letters, self.amounts, strict=True):
            if letter == "S":
                pieces.append(Piece(amount))
            elif letter == "L":
                pieces.extend(turn.pieces(amount))
            else:
                pieces.extend(piece.mirrored() for piece in turn.pieces(amount))
        return joined(pieces)


def shortest_word(start: PathPose, goal: PathPose, turn: Turn) -> Word:
    """Find the word of least length from `start` to `goal`."""
    best, best_length = Word("", ()), math.inf
    for word in words(start, goal, turn):
        length = word.length(turn)
        if length < best_length - TIE_M:
            best, best_length = word, length
    return best


def words(start: PathPose, goal: PathPose, turn: Turn) -> Iterator[Word]:
    """Generate every word from `start` to `goal`: S, L, R where they fit, and the valid ones of the six."""
    z, heading = goal.seen_from(start)
    if abs(z.imag) <= ON_PATH and z.real >= -ON_PATH and abs(math.remainder(heading, TAU)) <= ON_PATH:
        yield Word("S", (max(z.real, 0.0),))
    yield from _left_first(z, heading, turn.centre)
    for letters, amounts in _left_first(z.conjugate(), -heading, turn.centre):
        yield Word(letters.translate(_MIRROR), amounts)


def _left_first(goal: complex, heading: float, centre: complex) -> Iterator[Word]:
    """Generate the words that begin with a left turn, from the origin heading along +x."""
    radius, forward, side = abs(centre), centre.real, centre.imag
    goal_direction = cmath.rect(1.0, heading)
    left = goal - goal_direction * centre.conjugate()
    right = goal - goal_direction * centre

    between = left - centre
    distance = abs(between)
    if distance <= ON_PATH:
        yield Word("L", (_turn(heading),))
    straight = distance - 2.0 * forward
    if straight >= 0.0:
        course = cmath.phase(between)
        yield Word("LSL", (_turn(course), straight, _turn(heading - course)))
    if distance <= 4.0 * radius:
        # The middle circle touches both others; it can lie on either side of the line between their centres.
        along = between / distance if distance else 1.0
        height = math.sqrt(max(4.0 * radius * radius - 0.25 * distance * distance, 0.0))
        touch = cmath.phase(centre)
        for offset in (height, -height):
            middle = centre + 0.5 * between + 1j * along * offset
            first = cmath.phase(middle - centre) + touch
            second = cmath.phase(left - middle) - touch
            yield Word("LRL", (_turn(first), _turn(first - second), _turn(heading - second)))

    between = right - centre
    distance = abs(between)
    if distance >= 2.0 * radius:
        tangent = math.sqrt(distance * distance - 4.0 * side * side)
        course = cmath.phase(between) + math.atan2(2.0 * side, tangent)
        yield Word("LSR", (_turn(course), max(tangent - 2.0 * forward, 0.0), _turn(course - heading)))


def _turn(angle: float) -> float:
    """Wrap an angle to a deflection in [0, 2π); a rounding error short of a full turn counts as 0."""
    turn = math.remainder(angle, TAU)
    return turn + TAU if turn < -WRAP_RAD else max(turn, 0.0)
