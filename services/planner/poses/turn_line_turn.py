"""Method `turn-line-turn`: turn on the spot, drive straight, turn on the spot."""

import cmath
import math

from touchline.schemas.errors import PlanningError
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath, joined
from touchline.services.planner.poses.pose_method import PosePath, heading_note
from touchline.services.planner.poses.rest_to_rest import quickest
from touchline.services.planner.poses.traveller import Traveller
from touchline.services.planner.steering.g2 import turns_on_the_spot
from touchline.services.planner.steering.method import CurveEnd
from touchline.services.planner.steering.reversing import STRETCH_MIN_M


class TurnLineTurn:
    """Line between turns on the spot, driven forward or, if the vehicle may and it is quicker, backward."""

    def between(self, start: PathPose, goal: PathPose, traveller: Traveller) -> PosePath:
        """Plan the path; see `PoseMethod`.

        Raises:
            PlanningError: The vehicle may not turn on the spot, or the goal is too near to drive to.
        """
        if not traveller.can_spin:
            raise PlanningError(
                "",
                "has the pose method turn-line-turn, but the vehicle may not turn on the spot (drive.can_spin,"
                " forward_only)",
                "give the pose method g2, or allow it",
            )
        if math.isnan(goal.heading_rad):
            return _to_place(start, goal, traveller)
        offers = turns_on_the_spot(CurveEnd(start, 0.0), CurveEnd(goal, 0.0))
        allowed = [path for path in offers if traveller.can_reverse or all(piece.direction > 0 for piece in path)]
        if not allowed:
            least = f"{1e3 * STRETCH_MIN_M:g} mm"
            raise PlanningError(
                "", "has a goal too near to drive to", f"give one at least {least} away, or just turned"
            )
        return PosePath(PiecePath(start, quickest(allowed, traveller)))


def _to_place(start: PathPose, goal: PathPose, traveller: Traveller) -> PosePath:
    """Turn and drive to the goal's position, with the heading of the line."""
    seen, _ = goal._replace(heading_rad=0.0).seen_from(start)
    senses = (1, -1) if traveller.can_reverse else (1,)
    offers = [joined((Piece.spin(cmath.phase(d * seen)), Piece(abs(seen), direction=d))) for d in senses]
    path = PiecePath(start, quickest(offers, traveller))
    return PosePath(path, heading_note(path.end.heading_rad, "that of the line"))
