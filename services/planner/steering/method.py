"""Interface of transition methods, and the transition of a method between two painted curves."""

import cmath
import math
from typing import NamedTuple, Protocol

from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath, arc_displacement, joined

# A goal this close (m, rad, 1/m) to the extension of the curve just painted is on it.
ON_EXTENSION = 1e-10
# Speed beyond that of any robot, where none is given.
NO_LIMIT_MPS = 1e3


class CurveEnd(NamedTuple):
    """Beginning or end of a painted curve: pose, curvature (1/m) and maximum speed (m/s)."""

    pose: PathPose
    curvature_1pm: float
    speed_mps: float = NO_LIMIT_MPS


class TransitionMethod(Protocol):
    """Geometry of transitions from one painted curve to the next.

    Poses are of the middle of the axle, in the map frame; pieces are in driving order.
    """

    @property
    def name(self) -> str:
        """Name of the method in plan options."""

    def lead_in(self, curvature_1pm: float) -> tuple[Piece, ...]:
        """Pieces right before a painted curve that begins with this curvature (1/m, left positive)."""

    def lead_out(self, curvature_1pm: float) -> tuple[Piece, ...]:
        """Pieces right after a painted curve that ends with this curvature (1/m, left positive)."""

    def connect(self, start: PathPose, goal: PathPose) -> tuple[Piece, ...]:
        """Forward transition between two poses, straight (curvature 0) at both; exists for every pair."""

    def between(self, start: CurveEnd, goal: CurveEnd) -> tuple[Piece, ...]:
        """Forward transition from the end of one painted curve to the beginning of the next one."""

    def standing_transitions(self, start: CurveEnd, goal: CurveEnd, room_m: float = 0.0) -> list[tuple[Piece, ...]]:
        """Transitions with standstills, at cusps or for turns on the spot; empty if the method has none.

        They compete by time with those driven forward, as far as the vehicle may reverse and turn on the spot.

        Args:
            start: End of the last painted curve.
            goal: Beginning of the next one.
            room_m: Length (m) by which the painted curves are extended up to the first and from the last standstill,
                for the robot to brake and to accelerate.
        """


def transition(method: TransitionMethod, start: CurveEnd, goal: CurveEnd) -> PiecePath:
    """Path from the end of one painted curve to the beginning of the next one."""
    path = PiecePath(start.pose, method.between(start, goal))
    return extension(start, goal, path.length_m) or path


def through_straights(method: TransitionMethod, start: CurveEnd, goal: CurveEnd) -> tuple[Piece, ...]:
    """Join a method's lead-out, its path between straights, and its lead-in."""
    lead_out = method.lead_out(start.curvature_1pm)
    lead_in = method.lead_in(goal.curvature_1pm)
    between = method.connect(PiecePath(start.pose, lead_out).end, before(goal.pose, lead_in))
    return joined((*lead_out, *between, *lead_in))


def before(goal: PathPose, pieces: tuple[Piece, ...]) -> PathPose:
    """Pose from which `pieces` lead to `goal`."""
    end = PiecePath(PathPose(0.0, 0.0, 0.0), pieces).end
    heading = goal.heading_rad - end.heading_rad
    point = goal.point - cmath.rect(1.0, heading) * end.point
    return PathPose(point.real, point.imag, heading)


def extension(start: CurveEnd, goal: CurveEnd, length_max_m: float) -> PiecePath | None:
    """Extension of the painted curve from `start` to `goal`, as in a dashed line; None if there is none this short.

    Args:
        start: End of the painted curve.
        goal: Beginning of the next painted curve.
        length_max_m: Maximum length of the extension.
    """
    curvature = start.curvature_1pm
    chord, turn = goal.pose.seen_from(start.pose)
    length = 0.0 if abs(chord) <= ON_EXTENSION else _length_to(chord, curvature)
    if length > length_max_m:
        return None
    off_path = abs(arc_displacement(length, curvature) - chord)
    off_heading = abs(cmath.phase(cmath.rect(1.0, turn - curvature * length)))
    if max(off_path, off_heading, abs(curvature - goal.curvature_1pm)) > ON_EXTENSION:
        return None
    return PiecePath(start.pose, joined((Piece(length, curvature),)))


def _length_to(chord: complex, curvature_1pm: float) -> float:
    """Length (m) of the arc or line that begins along +x and has this chord, if the chord's end lies on it."""
    sine = min(0.5 * abs(curvature_1pm) * abs(chord), 1.0)
    half_turn = math.asin(sine)
    if chord.real < 0.0:
        half_turn = math.pi - half_turn
    return abs(chord) * half_turn / sine if sine else abs(chord)
