"""Methods `dubins`, `dubins-free` and `bearing`: arcs of one radius and lines, forward; curvature steps at every joint.

`bearing` is the heuristic of a study on a network of small robots: arrive in the direction in which the goal lies.
"""

import cmath
import math

from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath, joined
from touchline.services.planner.poses.kernels.free_heading import shortest_to_point
from touchline.services.planner.poses.pose_method import PosePath, heading_note
from touchline.services.planner.poses.traveller import Traveller
from touchline.services.planner.steering.dubins import dubins_pieces

SHORTEST = "that of the shortest path of arcs and lines to the place"


def to_point(start: PathPose, place: PathPose, curvature_1pm: float) -> PiecePath:
    """The shortest path of arcs of a curvature (1/m) and lines to a place, whatever the heading there."""
    seen, _ = place._replace(heading_rad=0.0).seen_from(start)
    first, line, last, _ = shortest_to_point(seen, 1.0 / curvature_1pm)
    return PiecePath(start, joined((_arc(first, curvature_1pm), Piece(line), _arc(last, curvature_1pm))))


def with_heading(start: PathPose, goal: PathPose, curvature_1pm: float) -> tuple[PathPose, str]:
    """The goal, and nothing; or if its heading is free, with that of the shortest path to it, and a note of that."""
    if not math.isnan(goal.heading_rad):
        return goal, ""
    heading = to_point(start, goal, curvature_1pm).end.heading_rad
    return goal._replace(heading_rad=heading), heading_note(heading, SHORTEST)


def _arc(turn_rad: float, curvature_1pm: float) -> Piece:
    return Piece(abs(turn_rad) / curvature_1pm, math.copysign(curvature_1pm, turn_rad))


class DubinsPaths:
    """The shortest of Dubins' six words; where the heading is free, the shortest path to the place."""

    def between(self, start: PathPose, goal: PathPose, traveller: Traveller) -> PosePath:
        """See `PoseMethod`."""
        if math.isnan(goal.heading_rad):
            return ToPoint().between(start, goal, traveller)
        return PosePath(PiecePath(start, dubins_pieces(start, goal, traveller.arc_curvature_1pm)))


class ToPoint:
    """The shortest path to the place; the goal's heading is not asked for."""

    def between(self, start: PathPose, goal: PathPose, traveller: Traveller) -> PosePath:
        """See `PoseMethod`."""
        path = to_point(start, goal, traveller.arc_curvature_1pm)
        return PosePath(path, heading_note(path.end.heading_rad, SHORTEST))


class Bearing:
    """Dubins' words to the goal's place with the bearing from the start as heading; the goal's is not asked for."""

    def between(self, start: PathPose, goal: PathPose, traveller: Traveller) -> PosePath:
        """See `PoseMethod`."""
        aimed = goal._replace(heading_rad=bearing_rad(start, goal))
        path = PiecePath(start, dubins_pieces(start, aimed, traveller.arc_curvature_1pm))
        return PosePath(path, heading_note(aimed.heading_rad, "the bearing from the start"))


def bearing_rad(start: PathPose, goal: PathPose) -> float:
    """In which direction (rad) a goal lies; at the goal itself, that in which the robot looks."""
    chord = goal.point - start.point
    return cmath.phase(chord) if chord else start.heading_rad
