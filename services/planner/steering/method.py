"""The interface of transition methods, and the transition that a method makes between two painted curves."""

import cmath
import math
from typing import NamedTuple, Protocol

from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath, arc_displacement, joined

# A goal this close (m, rad, 1/m) to the curve just painted, carried on, is on it: the path simply goes on.
CARRY_ON = 1e-10
# Where no speed is given: faster than any robot.
NO_LIMIT_MPS = 1e3


class CurveEnd(NamedTuple):
    """Where a painted curve begins or ends: pose and curvature (1/m) there, and at which speed (m/s) at most."""

    pose: PathPose
    curvature_1pm: float
    speed_mps: float = NO_LIMIT_MPS


class TransitionMethod(Protocol):
    """The geometry of a method's transitions: how the robot gets from one painted curve to the next.

    Poses are of the middle of the axle, in the map frame; all pieces are in the order in which they are driven.
    """

    @property
    def name(self) -> str:
        """The name by which plan options ask for the method."""

    def lead_in(self, curvature_1pm: float) -> tuple[Piece, ...]:
        """What comes right before a painted curve that begins with this curvature (1/m, left positive)."""

    def lead_out(self, curvature_1pm: float) -> tuple[Piece, ...]:
        """What comes right after a painted curve that ends with this curvature (1/m, left positive)."""

    def connect(self, start: PathPose, goal: PathPose) -> tuple[Piece, ...]:
        """The forward transition between two poses, straight (curvature 0) at both; exists for every pair."""

    def between(self, start: CurveEnd, goal: CurveEnd) -> tuple[Piece, ...]:
        """The forward transition from the end of one painted curve to the beginning of the next one."""

    def standing_transitions(self, start: CurveEnd, goal: CurveEnd, room_m: float = 0.0) -> list[tuple[Piece, ...]]:
        """Transitions on which the robot stands: with cusps, and with turns on the spot; empty if it offers none.

        They compete by time with those driven forward, as far as the vehicle may reverse and turn on the spot.

        Args:
            start: Where the last painted curve ends.
            goal: Where the next one begins.
            room_m: So far the painted curves are carried on before the first and after the last standstill, for the
                robot to brake and to gather speed (m).
        """


def transition(method: TransitionMethod, start: CurveEnd, goal: CurveEnd) -> PiecePath:
    """The path from the end of one painted curve to the beginning of the next one."""
    path = PiecePath(start.pose, method.between(start, goal))
    return carried_on(start, goal, path.length_m) or path


def through_straights(method: TransitionMethod, start: CurveEnd, goal: CurveEnd) -> tuple[Piece, ...]:
    """The method's lead-out, its path between straights, and its lead-in."""
    lead_out = method.lead_out(start.curvature_1pm)
    lead_in = method.lead_in(goal.curvature_1pm)
    between = method.connect(PiecePath(start.pose, lead_out).end, before(goal.pose, lead_in))
    return joined((*lead_out, *between, *lead_in))


def before(goal: PathPose, pieces: tuple[Piece, ...]) -> PathPose:
    """The pose from which `pieces` lead to `goal`."""
    end = PiecePath(PathPose(0.0, 0.0, 0.0), pieces).end
    heading = goal.heading_rad - end.heading_rad
    point = goal.point - cmath.rect(1.0, heading) * end.point
    return PathPose(point.real, point.imag, heading)


def carried_on(start: CurveEnd, goal: CurveEnd, length_max_m: float) -> PiecePath | None:
    """The line or arc that leads from `start` to `goal`, if one does so within a length (a dashed line or circle)."""
    curvature = start.curvature_1pm
    chord, turn = goal.pose.seen_from(start.pose)
    length = 0.0 if abs(chord) <= CARRY_ON else _length_to(chord, curvature)
    if length > length_max_m:
        return None
    off_path = abs(arc_displacement(length, curvature) - chord)
    off_heading = abs(cmath.phase(cmath.rect(1.0, turn - curvature * length)))
    if max(off_path, off_heading, abs(curvature - goal.curvature_1pm)) > CARRY_ON:
        return None
    return PiecePath(start.pose, joined((Piece(length, curvature),)))


def _length_to(chord: complex, curvature_1pm: float) -> float:
    """Length (m) of the arc (or line) along +x whose end `chord` would be, if it is on it."""
    sine = min(0.5 * abs(curvature_1pm) * abs(chord), 1.0)
    half_turn = math.asin(sine)
    if chord.real < 0.0:
        half_turn = math.pi - half_turn
    return abs(chord) * half_turn / sine if sine else abs(chord)
