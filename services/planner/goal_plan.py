"""Plan a drive to a pose, from rest or from amid another drive, without work along the path."""

import cmath
import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from touchline.schemas.errors import PlanningError
from touchline.schemas.known_ground import OPEN_GROUND, KnownGround
from touchline.schemas.messages import LeavingTrajectory, PlanOptions, PoseGoal, WaySearch
from touchline.schemas.plugins import POSE_METHODS, SPEED_LAWS
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.chosen_plugin import chosen
from touchline.services.planner.driven_part import DrivenPart
from touchline.services.planner.free_space.ground_ways import EVERYWHERE
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath, joined
from touchline.services.planner.given_pose import POSE_MAX, START, pose_of
from touchline.services.planner.plan import Plan, finished
from touchline.services.planner.poses.cubic_path import CubicPath
from touchline.services.planner.poses.g2_path import G2Path
from touchline.services.planner.poses.ground_method import GroundMethod
from touchline.services.planner.poses.guarded_poses import guarded_law, guarded_pose_method
from touchline.services.planner.poses.pose_method import PoseMethod, PosePath
from touchline.services.planner.poses.speed_laws import SpeedLaw, timed
from touchline.services.planner.poses.traveller import Traveller
from touchline.services.planner.route.worked_route import WorkedRoute
from touchline.services.planner.running_leg import RunningLeg
from touchline.services.planner.segments.section import TRANSITION, Section
from touchline.services.planner.segments.sent_segments import Sent, send
from touchline.services.planner.speed.path_grid import course
from touchline.services.planner.speed.timing import keeps_entry, speed_profile
from touchline.services.planner.steering.method import CurveEnd
from touchline.services.planner.steering.reversing import STRETCH_MIN_M

GOAL_OPTIONS: Final = ("kappa_max_1pm", "sigma_max_1pm2", "transit_speed_mps", "forward_only", "margin_m")
"""Options that apply to a drive to a goal, besides the start."""

# A goal this near to the start (m, rad) is at the start.
SAME = 1e-6
# Length (m) of the straight before a drive that only turns. It defines the heading at the start, and begins behind the
# robot, which projects itself onto the path and so does not move along it.
LEAD_M = 0.5e-3


def plan_to_goal(
    goal: PoseGoal,
    vehicle: Vehicle,
    options: PlanOptions,
    leaving: LeavingTrajectory | None = None,
    ground: KnownGround = OPEN_GROUND,
    search: WaySearch = EVERYWHERE,
) -> Plan:
    """Plan a trajectory from the start in the options to a goal, from rest to rest, or from amid another drive.

    Only the start and `GOAL_OPTIONS` of the options apply. A drive that is left is kept for a while as it was sent.
    From there the robot drives on to the goal if that is the quickest and method g2 with the default law is asked for;
    else it stops on its path as soon as it can, and starts again.

    Args:
        goal: Goal pose, with method, law and duration, which counts from the last standstill before the new path.
        vehicle: Vehicle that drives.
        options: Start and limits; by default the vehicle's.
        leaving: Trajectory that the robot is driving, instead of a start.
        ground: Boundary and obstacles, which the body keeps `margin_m` of the options off.
        search: What is looked for.

    Raises:
        PlanningError: The start, the goal or an option cannot be met.
    """
    traveller, method = Traveller.of(vehicle, options), _method(goal, _law(goal))
    traveller = replace(traveller, can_reverse=traveller.can_reverse and not search.no_reversing)
    if ground != OPEN_GROUND:
        method = GroundMethod(method, ground, vehicle.body.footprint_m, options.margin_m, search)
    if leaving is not None and len(options.start):
        raise PlanningError("", "has a start and a drive to leave", "give options.start or leaving")
    if leaving is None:
        part = _from_standing(_start(options), goal, method, traveller)
    else:
        part = _from_drive(leaving, goal, method, traveller, vehicle)
    made = finished(WorkedRoute(part.sections), part.sent, [], part.speeds, vehicle, traveller.limits)
    return replace(made, notes=part.notes)


def _from_drive(
    leaving: LeavingTrajectory, goal: PoseGoal, method: PoseMethod, traveller: Traveller, vehicle: Vehicle
) -> DrivenPart:
    """Plan without a stop and with a stop first, and take the quicker."""
    leg = RunningLeg.of(leaving)
    kept, kept_to_m = leg.kept(leaving)
    end = leg.end_of(kept)
    if not end.speed_mps:
        return kept.then(_from_rest(end.pose, goal, method, traveller))
    stopped = kept.then(leg.stopped(kept_to_m, vehicle))
    law = _law(goal)
    fastest = law is None and not goal.duration_s
    offers = list[DrivenPart]()
    if leg.direction > 0 and fastest and isinstance(_method(goal, law), G2Path):
        offers += [kept.then(moving) for moving in _moving(end, goal, method, traveller)]
    try:
        offers.insert(0, stopped.then(_from_rest(leg.end_of(stopped).pose, goal, method, traveller)))
    except PlanningError:
        if not offers:
            raise
    return min(offers, key=lambda each: each.speeds.total_time_s)


def _moving(start: CurveEnd, goal: PoseGoal, method: PoseMethod, traveller: Traveller) -> Iterator[DrivenPart]:
    """Quickest drive to the goal that can be entered at the current speed, if there is one."""
    aimed = _goal(goal)
    moving = method.moving if isinstance(method, GroundMethod) else G2Path().moving
    for offer in moving(start, aimed, traveller):
        sections = [Section(TRANSITION, offer.path)]
        sent = _sent(sections, traveller)
        speeds = speed_profile(course(sections, sent, (), traveller.limits), (), traveller.limits, start.speed_mps)
        if keeps_entry(speeds, start.speed_mps):
            yield DrivenPart(sections, sent, speeds, (offer.note,) if offer.note else ())
            return


def _from_standing(start: PathPose, goal: PoseGoal, method: PoseMethod, traveller: Traveller) -> DrivenPart:
    """Drive of a robot without a trajectory before; turns on the spot get a straight that defines their heading."""
    posed = _pose_path(start, goal, method, traveller)
    return _driven(posed if posed.path.length_m else replace(posed, path=_with_straight(posed.path)), goal, traveller)


def _from_rest(start: PathPose, goal: PoseGoal, method: PoseMethod, traveller: Traveller) -> DrivenPart:
    return _driven(_pose_path(start, goal, method, traveller), goal, traveller)


def _pose_path(start: PathPose, goal: PoseGoal, method: PoseMethod, traveller: Traveller) -> PosePath:
    aimed = _goal(goal)
    _refuse_standing(start, aimed)
    too_near = 0.0 < abs(aimed.point - start.point) < STRETCH_MIN_M
    if too_near and traveller.can_spin and not math.isnan(aimed.heading_rad):
        start = PathPose(aimed.x_m, aimed.y_m, start.heading_rad)  # turn there
    return method.between(start, aimed, traveller)


def _driven(posed: PosePath, goal: PoseGoal, traveller: Traveller) -> DrivenPart:
    """Add the speeds of the goal's law to a path."""
    law = _law(goal)
    sections = [Section(TRANSITION, posed.path)]
    sent = _sent(sections, traveller)
    speeds = timed(
        lambda borders_m: course(sections, sent, borders_m.tolist(), traveller.limits),
        law,
        goal.duration_s,
        traveller.limits,
        posed.progress,
    )
    notes = [posed.note] if posed.note else []
    if law is not None and law.moving:
        late_s = float(speeds.speed_mps[0]) / (2.0 * traveller.limits.acceleration_mps2)
        notes.append(f"begins at {speeds.speed_mps[0]:.3f} m/s, so a robot at rest is {late_s:.2f} s late")
    return DrivenPart(sections, sent, speeds, tuple(notes))


def _sent(sections: list[Section], traveller: Traveller) -> list[Sent]:
    return send(sections, lambda fraction: None, curvature_max_1pm=traveller.limits.drive.curvature_max_1pm)


def _with_straight(turns: PiecePath) -> PiecePath:
    """Put a straight before turns on the spot, as a trajectory has headings of curves only."""
    back, heading_rad = cmath.rect(LEAD_M, turns.start.heading_rad), turns.start.heading_rad
    start = PathPose(turns.start.x_m - back.real, turns.start.y_m - back.imag, heading_rad)
    return PiecePath(start, joined((Piece(LEAD_M), *turns.pieces)))


def _start(options: PlanOptions) -> PathPose:
    start = pose_of(START, options.start)
    if start is None:
        raise PlanningError("", "has a goal, but no start pose", "give options.start: x (m), y (m) and heading (rad)")
    return start


def _goal(goal: PoseGoal) -> PathPose:
    """Pose of a goal; its heading may be NaN."""
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
    """Create the method that the goal names, with the goal's tangents and law for a cubic curve."""
    method: PoseMethod = chosen(POSE_METHODS, goal.method, "pose method")
    if isinstance(method, CubicPath):
        return CubicPath(tuple(goal.tangents_m.tolist()), law)
    if len(goal.tangents_m):
        raise PlanningError("", f"has goal.tangents_m with the pose method {goal.method!r}", "give the method cubic")
    return guarded_pose_method(method, goal.method)


def _law(goal: PoseGoal) -> SpeedLaw | None:
    """Look up the speed law that the goal names."""
    return guarded_law(chosen(SPEED_LAWS, goal.law, "speed law"), goal.law)
