"""Plan a drive to a pose: nothing is worked on along the way."""

import math
from dataclasses import replace

from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions, PoseGoal
from touchline.schemas.plugins import POSE_METHODS, SPEED_LAWS
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.chosen_plugin import chosen
from touchline.services.planner.geometry.clothoid import PathPose
from touchline.services.planner.marking import POSE_MAX, pose_of
from touchline.services.planner.plan import Plan, finished
from touchline.services.planner.poses.cubic_path import CubicPath
from touchline.services.planner.poses.laws import SpeedLaw, timed
from touchline.services.planner.poses.pose_method import PoseMethod
from touchline.services.planner.poses.traveller import Traveller
from touchline.services.planner.route.worked_route import WorkedRoute
from touchline.services.planner.segments.section import TRANSITION, Section
from touchline.services.planner.segments.sent_segments import send
from touchline.services.planner.speed.path_grid import course

# A goal this near to the start (m, rad) is the start.
SAME = 1e-6


def plan_to_goal(goal: PoseGoal, vehicle: Vehicle, options: PlanOptions) -> Plan:
    """The trajectory from the start of the options to a goal, from rest to rest.

    Of the options, start, curvature, sharpness, transit speed and `forward_only` matter.

    Args:
        goal: Where to, and by which method, law and time.
        vehicle: That shall drive there.
        options: Where from, and within which limits; by default the vehicle's own.

    Raises:
        PlanningError: The start, the goal or an option cannot be met; it names which and what to do.
    """
    start, aimed = _start(options), _goal(goal)
    _refuse_standing(start, aimed)
    traveller = Traveller.of(vehicle, options)
    law = chosen(SPEED_LAWS, goal.law, "speed law")
    found = _method(goal, law).between(start, aimed, traveller)
    if not found.path.length_m:
        raise PlanningError(
            "",
            "has its goal where the robot stands, but turned, and a trajectory of turns alone does not say from where",
            "give a goal some way off, or the pose method dubins",
        )
    sections = [Section(TRANSITION, found.path)]
    sent = send(sections, lambda fraction: None)
    speeds = timed(
        lambda borders_m: course(sections, sent, borders_m.tolist(), traveller.limits),
        law,
        goal.duration_s,
        traveller.limits,
        found.progress,
    )
    notes = [found.note] if found.note else []
    if law is not None and law.moving:
        late_s = float(speeds.speed_mps[0]) / (2.0 * traveller.limits.acceleration_mps2)
        notes.append(f"begins at {speeds.speed_mps[0]:.3f} m/s, so a robot at rest is {late_s:.2f} s late")
    made = finished(WorkedRoute(sections), sent, [], speeds, vehicle, traveller.limits)
    return replace(made, notes=tuple(notes))


def _start(options: PlanOptions) -> PathPose:
    start = pose_of("start", options.start)
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
    return method
