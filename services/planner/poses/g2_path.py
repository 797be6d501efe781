"""Method `g2`: quickest curvature-continuous path, with cusps and turns on the spot if the vehicle may."""

from touchline.services.planner.geometry.clothoid import PathPose, PiecePath
from touchline.services.planner.poses.dubins_paths import with_heading
from touchline.services.planner.poses.pose_method import PosePath
from touchline.services.planner.poses.traveller import Traveller
from touchline.services.planner.steering.g2 import Steering
from touchline.services.planner.steering.method import CurveEnd
from touchline.services.planner.transitions.transitions import REVERSING, SPINNING, TransitionFamily, Turns


class G2Path:
    """Quickest transition of method `g2` from rest to rest; one exists for every two poses."""

    def between(self, start: PathPose, goal: PathPose, traveller: Traveller) -> PosePath:
        """Plan the path; see `PoseMethod`."""
        aimed, note = with_heading(start, goal, traveller.limits.curvature_max_1pm)
        return PosePath(paths_by_g2(start, aimed, traveller)[0], note)

    def moving(self, start: CurveEnd, goal: PathPose, traveller: Traveller) -> list[PosePath]:
        """Paths from amid a drive to rest at a goal, the quickest first; continuous in curvature from the start on."""
        aimed, note = with_heading(start.pose, goal, traveller.limits.curvature_max_1pm)
        return [PosePath(path, note) for path in moving_paths(start, CurveEnd(aimed, 0.0, speed_mps=0.0), traveller)]


def paths_by_g2(start: PathPose, goal: PathPose, traveller: Traveller) -> list[PiecePath]:
    """Paths from rest to rest, with turns for several shares of the transit speed, the quickest first."""
    return moving_paths(CurveEnd(start, 0.0, speed_mps=0.0), CurveEnd(goal, 0.0, speed_mps=0.0), traveller)


def moving_paths(start: CurveEnd, goal: CurveEnd, traveller: Traveller) -> list[PiecePath]:
    """Paths from amid one drive to amid another, with turns for several shares of the transit speed, quickest first."""
    able = {REVERSING: traveller.can_reverse, SPINNING: traveller.can_spin}
    turns = tuple(Turns(speed, *turn, Steering(*turn)) for turn, speed in traveller.turns.items())
    family = TransitionFamily(traveller.limits, turns, frozenset(skill for skill, can in able.items() if can))
    return [transition.path for transition in family.between(start, goal)]
