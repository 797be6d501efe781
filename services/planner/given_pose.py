"""Pose given by the options of a plan."""

from typing import Final

from touchline.schemas.errors import PlanningError
from touchline.schemas.given_angles import FULL_TURN_RAD, instead_of_degrees
from touchline.services.planner.geometry.clothoid import Floats, PathPose

START: Final = "start"
POSE_MAX: Final = 20_000.0
"""Maximum coordinate of a pose (m); more is a mistake."""


def pose_of(name: str, given: Floats) -> PathPose | None:
    """Convert a pose option of a plan; None if it is empty.

    The heading of a start, which a robot reports, may include several turns; the heading of an end may not.

    Raises:
        PlanningError: The option is no pose on a field.
    """
    if not len(given):
        return None
    pose = PathPose(*given.tolist()) if len(given) == len(PathPose._fields) else None
    if pose is None or not all(abs(value) < POSE_MAX for value in pose):
        raise PlanningError("", f"has an unusable {name} pose", "give x (m), y (m) and heading (rad) on the field")
    if name != START and abs(pose.heading_rad) > FULL_TURN_RAD:
        remedy = f"give it {instead_of_degrees(pose.heading_rad)}"
        raise PlanningError("", f"has a {name} heading of {pose.heading_rad:g}", remedy)
    return pose
