"""The robot's own message tree: ``tt_geometry_msgs`` and ``tt_trajectory_msgs``."""

from typing import Annotated, ClassVar

from pydantic import Field

from touchline.schemas.messages.base import Int8, Message, UInt8
from touchline.schemas.messages.standard import Point


class CurveType(Message):
    """Kind of curve that is present."""

    ros_type: ClassVar[str] = "tt_geometry_msgs/msg/CurveType"
    NONE: ClassVar[int] = 0
    LINE: ClassVar[int] = 1
    ARC: ClassVar[int] = 2
    value: Annotated[UInt8, Field(le=2)] = 0


class Line(Message):
    """Straight line; metres."""

    ros_type: ClassVar[str] = "tt_geometry_msgs/msg/Line"
    start: Point = Point()
    end: Point = Point()


class Arc(Message):
    """Circular arc; metres and radians, counter-clockwise positive."""

    ros_type: ClassVar[str] = "tt_geometry_msgs/msg/Arc"
    start: Point = Point()
    center: Point = Point()
    sweep_angle: float = 0.0


class CurveMessage(Message):
    """A line or an arc."""

    ros_type: ClassVar[str] = "tt_geometry_msgs/msg/Curve"
    type: CurveType = CurveType()
    line: Annotated[tuple[Line, ...], Field(max_length=1)] = ()
    arc: Annotated[tuple[Arc, ...], Field(max_length=1)] = ()


class LinearDirection(Message):
    """Sense of travel along a curve."""

    ros_type: ClassVar[str] = "tt_geometry_msgs/msg/LinearDirection"
    BACKWARD: ClassVar[int] = -1
    NONE: ClassVar[int] = 0
    FORWARD: ClassVar[int] = 1
    value: Annotated[Int8, Field(ge=-1, le=1)] = 0


class Segment(Message):
    """One curve of a path and the direction in which it is driven."""

    ros_type: ClassVar[str] = "tt_trajectory_msgs/msg/Segment"
    id: str = ""
    label: str = ""
    curve: CurveMessage = CurveMessage()
    direction: LinearDirection = LinearDirection()


class Path(Message):
    """Segments in the order in which they are driven."""

    ros_type: ClassVar[str] = "tt_trajectory_msgs/msg/Path"
    segments: tuple[Segment, ...] = ()


class Actuation(Message):
    """A bit mask of pump, valve and disc."""

    ros_type: ClassVar[str] = "tt_trajectory_msgs/msg/Actuation"
    NONE: ClassVar[int] = 0
    PUMP: ClassVar[int] = 1
    VALVE: ClassVar[int] = 2
    SPRAY: ClassVar[int] = 3
    DISC: ClassVar[int] = 4
    DISC_SPRAY: ClassVar[int] = 7
    ALL: ClassVar[int] = 7
    value: Annotated[UInt8, Field(le=7)] = 0


class PathActuationParameter(Message):
    """From ``arc_length`` (m) on, until the next entry, this actuation."""

    ros_type: ClassVar[str] = "tt_trajectory_msgs/msg/PathActuationParameter"
    arc_length: float = 0.0
    actuation: Actuation = Actuation()


class ActuationProfile(Message):
    """Actuation as a step function of the path's arc length."""

    ros_type: ClassVar[str] = "tt_trajectory_msgs/msg/ActuationProfile"
    parameters: tuple[PathActuationParameter, ...] = ()


class VelocityType(Message):
    """Kind of velocity: linear (m/s) or angular (rad/s, turning on the spot)."""

    ros_type: ClassVar[str] = "tt_trajectory_msgs/msg/VelocityType"
    NONE: ClassVar[int] = 0
    LINEAR: ClassVar[int] = 1
    ANGULAR: ClassVar[int] = 2
    value: Annotated[UInt8, Field(le=2)] = 0


class Velocity(Message):
    """A velocity of the given type."""

    ros_type: ClassVar[str] = "tt_trajectory_msgs/msg/Velocity"
    type: VelocityType = VelocityType()
    value: float = 0.0


class PathVelocityParameter(Message):
    """The velocity at ``arc_length`` (m)."""

    ros_type: ClassVar[str] = "tt_trajectory_msgs/msg/PathVelocityParameter"
    arc_length: float = 0.0
    velocity: Velocity = Velocity()


class VelocityProfile(Message):
    """Velocity over arc length; between two entries v² is linear in arc length (constant acceleration)."""

    ros_type: ClassVar[str] = "tt_trajectory_msgs/msg/VelocityProfile"
    parameters: tuple[PathVelocityParameter, ...] = ()


class Trajectory(Message):
    """Trajectory that the robot executes."""

    ros_type: ClassVar[str] = "tt_trajectory_msgs/msg/Trajectory"
    path: Path = Path()
    actuation_profile: ActuationProfile = ActuationProfile()
    velocity_profile: VelocityProfile = VelocityProfile()


class StartTraversalRequest(Message):
    """Load a trajectory and start it."""

    ros_type: ClassVar[str] = "tt_trajectory_msgs/srv/StartTraversal_Request"
    trajectory: Trajectory = Trajectory()


class StartTraversalResponse(Message):
    """``total_time`` (s) that the traversal will take; ``success`` false when it was refused."""

    ros_type: ClassVar[str] = "tt_trajectory_msgs/srv/StartTraversal_Response"
    total_time: float = 0.0
    success: bool = False
