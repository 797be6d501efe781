"""Messages about things near the robot."""

from typing import ClassVar

from touchline.schemas.messages.base import Float64Array, Message, UInt32, zeros
from touchline.schemas.messages.standard import Header, Time


class Obstacle(Message):
    """A thing near the robot, as its lidars see it, in the map frame.

    ``id`` is a number of its own, or, of a ``known`` one, its place in the list of outlines that the plan knows, from
    0. ``kind`` is by size and motion: ``person``, ``post``, ``wall`` or ``thing``. ``missing``: it is known, but its
    place was seen to be free. The outline is convex, with a margin; of a known thing it is the plan's. ``last_seen`` is
    zero of a known one that was never seen.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/Obstacle"
    id: UInt32 = 0
    kind: str = ""
    known: bool = False
    missing: bool = False
    moving: bool = False
    x_m: float = 0.0
    y_m: float = 0.0
    position_sigma_m: float = 0.0
    vx_mps: float = 0.0
    vy_mps: float = 0.0
    velocity_sigma_mps: float = 0.0
    outline_x_m: Float64Array = zeros(0)
    outline_y_m: Float64Array = zeros(0)
    last_seen: Time = Time()


class Obstacles(Message):
    """Things near the robot: unknown ones that it tracks, and known ones that it sees or misses."""

    ros_type: ClassVar[str] = "touchline_msgs/msg/Obstacles"
    header: Header = Header()
    obstacles: tuple[Obstacle, ...] = ()
