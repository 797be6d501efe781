"""Plan a drive to a pose, from rest or from amid another drive: nothing is worked on along the way."""

import cmath
import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import LeavingTrajectory, PlanOptions, PoseGoal
from touchline.schemas.plugins import POSE_METHODS, SPEED_LAWS
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.chosen_plugin import chosen
from touchline.services.planner.driven_part import DrivenPart
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath, joined
from touchline.services.planner.given_pose import POSE_MAX, START, pose_of
from touchline.services.planner.leaving import RunningLeg
from touchline.services.planner.plan import Plan, finished
from touchline.services.planner.poses.cubic_path import CubicPath
from touchline.services.planner.poses.g2_path import G2Path
from touchline.services.planner.poses.guarded_poses import guarded_law, guarded_pose_method
from touchline.services.planner.poses.laws import SpeedLaw, timed
from touchline.services.planner.poses.pose_method import PoseMethod, PosePath
from touchline.services.planner.poses.traveller import Traveller
from touchline.services.planner.route.worked_route import WorkedRoute
from touchline.services.planner.segments.section import TRANSITION, Section
from touchline.services.planner.segments.sent_segments import Sent, send
from touchline.services.planner.speed.path_grid import course
from touchline.services.planner.speed.timing import keeps_entry, speed_profile
from touchline.services.planner.steering.method import CurveEnd
from touchline.services.planner.steering.reversing import STRETCH_MIN_M

GOAL_OPTIONS: Final = ("kappa_max_1pm", "sigma_max_1pm2", "transit_speed_mps", "forward_only")
"""What matters of a plan's options, beside the start, on the way to a goal."""

# A goal this near to the start (m, rad) is the start.
SAME = 1e-6
# A drive that only turns begins so far (m) behind the robot, with a straight that tells from which heading. The robot,
# which takes itself to be at its path's nearest place, does not move along it.
TELLING_M = 0.5e-3


def plan_to_goal(
    goal: PoseGoal, vehicle: Vehicle, options: PlanOptions, leaving: LeavingTrajectory | None = None
) -> Plan:
    """The trajectory from the start of the options to a goal, from rest to rest; or from amid another drive.

    Of the options, the start and `GOAL_OPTIONS` matter. A drive that is left is kept
    for a while as it was sent. From there the robot drives on to the goal if that is the quickest and method g2 and no
    other law are asked for; else it stops on its way as soon as it can, and begins anew.

    Args:
        goal: Where to, and by which method, law and time, which counts from the last standstill before the new way.
        vehicle: That shall drive there.
        options: Where from, and within which limits; by default the vehicle's own.
        leaving: What the robot is driving; then there is no start.

    Raises:
        PlanningError: The start, the goal or an option cannot be met; it names which and what to do.
    """
    traveller = Traveller.of(vehicle, options)
    if leaving is None:
        part = _from_standing(_start(options), goal, traveller)
    else:
        part = _from_drive(leaving, goal, traveller, vehicle, options)
    made = finished(WorkedRoute(part.sections), part.sent, [], part.speeds, vehicle, traveller.limits)
    return replace(made, notes=part.notes)


def _from_drive(
    leaving: LeavingTrajectory, goal: PoseGoal, traveller: Traveller, vehicle: Vehicle, options: PlanOptions
) -> DrivenPart:
    """The quicker of going on without a stop, and of stopping first."""
    if len(options.start):
        raise PlanningError("", "has a start and a drive to leave", "give options.start or leaving")
    leg = RunningLeg.of(leaving)
    kept, kept_to_m = leg.kept(leaving)
    end = leg.end_of(kept)
    if not end.speed_mps:
        return kept.then(_from_rest(end.pose, goal, traveller))
    stopped = kept.then(leg.stopped(kept_to_m, vehicle))
    offers = [stopped.then(_from_rest(leg.end_of(stopped).pose, goal, traveller))]
    law = _law(goal)
    fastest = law is None and not goal.duration_s
    if leg.direction > 0 and fastest and isinstance(_method(goal, law), G2Path):
        offers += [kept.then(moving) for moving in _moving(end, goal, traveller)]
    return min(offers, key=lambda each: each.speeds.total_time_s)


def _moving(start: CurveEnd, goal: PoseGoal, traveller: Traveller) -> Iterator[DrivenPart]:
    """The quickest drive from amid another to the goal without slowing down at once, if there is one."""
    for offer in G2Path().moving(start, _goal(goal), traveller):
        sections = [Section(TRANSITION, offer.path)]
        sent = _sent(sections, traveller)
        speeds = speed_profile(course(sections, sent, (), traveller.limits), (), traveller.limits, start.speed_mps)
        if keeps_entry(speeds, start.speed_mps):
            yield DrivenPart(sections, sent, speeds, (offer.note,) if offer.note else ())
            return


def _from_standing(start: PathPose, goal: PoseGoal, traveller: Traveller) -> DrivenPart:
    """The drive of a robot that nothing has told yet from which heading it is to turn on the spot."""
    way = _way(start, goal, traveller)
    return _driven(way if way.path.length_m else replace(way, path=_told(way.path)), goal, traveller)


def _from_rest(start: PathPose, goal: PoseGoal, traveller: Traveller) -> DrivenPart:
    return _driven(_way(start, goal, traveller), goal, traveller)


def _way(start: PathPose, goal: PoseGoal, traveller: Traveller) -> PosePath:
    aimed = _goal(goal)
    _refuse_standing(start, aimed)
    too_near = 0.0 < abs(aimed.point - start.point) < STRETCH_MIN_M
    if too_near and traveller.can_spin and not math.isnan(aimed.heading_rad):
        start = PathPose(aimed.x_m, aimed.y_m, start.heading_rad)  # turn there
    return _method(goal, _law(goal)).between(start, aimed, traveller)


def _driven(way: PosePath, goal: PoseGoal, traveller: Traveller) -> DrivenPart:
    """The way, with the speeds of the goal's law."""
    law = _law(goal)
    sections = [Section(TRANSITION, way.path)]
    sent = _sent(sections, traveller)
    speeds = timed(
        lambda borders_m: course(sections, sent, borders_m.tolist(), traveller.limits),
        law,
        goal.duration_s,
        traveller.limits,
        way.progress,
    )
    notes = [way.note] if way.note else []
    if law is not None and law.moving:
        late_s = float(speeds.speed_mps[0]) / (2.0 * traveller.limits.acceleration_mps2)
        notes.append(f"begins at {speeds.speed_mps[0]:.3f} m/s, so a robot at rest is {late_s:.2f} s late")
    return DrivenPart(sections, sent, speeds, tuple(notes))


def _sent(sections: list[Section], traveller: Traveller) -> list[Sent]:
    return send(sections, lambda fraction: None, curvature_max_1pm=traveller.limits.drive.curvature_max_1pm)


def _told(turns: PiecePath) -> PiecePath:
    """A path of turns on the spot alone, with a straight before them, for a trajectory has headings of curves only."""
    back, heading_rad = cmath.rect(TELLING_M, turns.start.heading_rad), turns.start.heading_rad
    start = PathPose(turns.start.x_m - back.real, turns.start.y_m - back.imag, heading_rad)
    return PiecePath(start, joined((Piece(TELLING_M), *turns.pieces)))


def _start(options: PlanOptions) -> PathPose:
    start = pose_of(START, options.start)
    if start is None:
        raise PlanningError("", "has a goal, but no start pose", "give options.start: x (m), y (m) and heading (rad)")
    return start


def _goal(goal: PoseGoal) -> PathPose:
    """The pose; its heading may be NaN."""
    for name in ("x_m", "y_m"):
        if not abs(getattr(goal, name)) < POSE_MAX:
            raise PlanningError("", f"has goal.{name} = {getattr(goal, name):g}", "give metres on the field")
    if math.isinf(goal.heading_rad):
        raise PlanningError("", f"has goal.heading_rad = {goal.heading_rad:g}", "give radians, or NaN for any")
    return PathPose(goal.x_m, goal.y_m, goal.heading_rad)


def _refuse_standing(start: PathPose, goal: PathPose) -> None:
    if abs(goal.point - start.point) > SAME:
        return
    if not abs(math.remainder(goal.heading_rad - start.heading_rad, math.tau)) > SAME:
        raise PlanningError("", "has its goal at its start", "give another goal: the robot is there already")


def _method(goal: PoseGoal, law: SpeedLaw | None) -> PoseMethod:
    """The method that the goal names; a cubic curve with the goal's tangents, or chosen for the law."""
    method: PoseMethod = chosen(POSE_METHODS, goal.method, "pose method")
    if isinstance(method, CubicPath):
        return CubicPath(tuple(goal.tangents_m.tolist()), law)
    if len(goal.tangents_m):
        raise PlanningError("", f"has goal.tangents_m with the pose method {goal.method!r}", "give the method cubic")
    return guarded_pose_method(method, goal.method)


def _law(goal: PoseGoal) -> SpeedLaw | None:
    """The speed law that the goal names."""
    return guarded_law(chosen(SPEED_LAWS, goal.law, "speed law"), goal.law)
