"""Methods `dubins`, `dubins-free` and `bearing`: arcs of one radius and lines, forward; curvature steps at every joint.

`bearing` is the heuristic of a study on a network of small robots: arrive in the direction from start to goal.
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
    """Shortest path of arcs of a curvature (1/m) and lines to a point, with any heading there."""
    seen, _ = place._replace(heading_rad=0.0).seen_from(start)
    first, line, last, _ = shortest_to_point(seen, 1.0 / curvature_1pm)
    return PiecePath(start, joined((_arc(first, curvature_1pm), Piece(line), _arc(last, curvature_1pm))))


def with_heading(start: PathPose, goal: PathPose, curvature_1pm: float) -> tuple[PathPose, str]:
    """Give a goal with a free heading that of the shortest path to it; also return a note, "" if nothing was chosen."""
    if not math.isnan(goal.heading_rad):
        return goal, ""
    heading = to_point(start, goal, curvature_1pm).end.heading_rad
    return goal._replace(heading_rad=heading), heading_note(heading, SHORTEST)


def _arc(turn_rad: float, curvature_1pm: float) -> Piece:
    return Piece(abs(turn_rad) / curvature_1pm, math.copysign(curvature_1pm, turn_rad))


class DubinsPaths:
    """Shortest of Dubins' six words; if the goal's heading is free, the shortest path to the point."""

    def between(self, start: PathPose, goal: PathPose, traveller: Traveller) -> PosePath:
        """Plan the path; see `PoseMethod`."""
        if math.isnan(goal.heading_rad):
            return ToPoint().between(start, goal, traveller)
        return PosePath(PiecePath(start, dubins_pieces(start, goal, traveller.arc_curvature_1pm)))


class ToPoint:
    """Shortest path to the point; ignores the goal's heading."""

    def between(self, start: PathPose, goal: PathPose, traveller: Traveller) -> PosePath:
        """Plan the path; see `PoseMethod`."""
        path = to_point(start, goal, traveller.arc_curvature_1pm)
        return PosePath(path, heading_note(path.end.heading_rad, SHORTEST))


class Bearing:
    """Dubins' words with the bearing from the start as heading at the goal; ignores the goal's heading."""

    def between(self, start: PathPose, goal: PathPose, traveller: Traveller) -> PosePath:
        """Plan the path; see `PoseMethod`."""
        aimed = goal._replace(heading_rad=bearing_rad(start, goal))
        path = PiecePath(start, dubins_pieces(start, aimed, traveller.arc_curvature_1pm))
        return PosePath(path, heading_note(aimed.heading_rad, "the bearing from the start"))


def bearing_rad(start: PathPose, goal: PathPose) -> float:
    """Bearing (rad) of a goal from the start; at the goal itself, the robot's heading."""
    chord = goal.point - start.point
    return cmath.phase(chord) if chord else start.heading_rad
