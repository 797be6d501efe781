"""What a robot of a team and its coordinator tell each other: docs/fleet.md has the rules."""

from typing import ClassVar, Final

from touchline.schemas.messages.base import Float64Array, Message, UInt32, zeros
from touchline.schemas.messages.standard import Header

FIRST_CELL: Final = 0
"""The number of the cell that every robot has where it stands at the start."""


class Guidance(Message):
    """Where a robot may be and where it should go, until there is something newer.

    The cell is the intersection of ``half_planes`` n·q ≤ offset, three numbers each: outward unit normal (x, y) and
    offset in m, map frame. ``number`` counts the cells; ``echo_s`` is the newest stamp of the robot's whereabouts that
    counts, by its own clock; the target, in the cell, is where to go.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/Guidance"
    header: Header = Header()
    number: UInt32 = 0
    echo_s: float = 0.0
    target_x_m: float = 0.0
    target_y_m: float = 0.0
    half_planes: Float64Array = zeros(0)


class Whereabouts(Message):
    """Where a guided robot is, where it would stand if it braked now, and which cell it keeps to.

    ``stamp_s`` is of its own clock, and later in every message. ``adopted`` is the number of the cell that it keeps to,
    0 where it stood at the start; ``decided`` the highest number that it has adopted or refused.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/Whereabouts"
    header: Header = Header()
    stamp_s: float = 0.0
    x_m: float = 0.0
    y_m: float = 0.0
    stop_x_m: float = 0.0
    stop_y_m: float = 0.0
    adopted: UInt32 = 0
    decided: UInt32 = 0
