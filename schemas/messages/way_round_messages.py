"""Ways of a robot round things in its way."""

from typing import ClassVar

from touchline.schemas.messages.base import Float64Array, Message, UInt8, UInt32, zeros
from touchline.schemas.messages.plan_messages import LeftOutStretch
from touchline.schemas.messages.standard import Header, Time


class LeftOutPatch(Message):
    """A patch of an area that a covering tool leaves out.

    ``outline`` is the id of the outline beside which it lies, ``operator``, ``plan`` (left out from the beginning),
    ``too small`` (for another drive), or empty. Its corners go round it once; ``size_m2`` excludes its holes.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/LeftOutPatch"
    area_id: str = ""
    outline: str = ""
    size_m2: float = 0.0
    corners_x_m: Float64Array = zeros(0)
    corners_y_m: Float64Array = zeros(0)


class WayRound(Message):
    """Report on things in a robot's way: what it does about them, and what of the job it has not done for them.

    It is sent whenever that changes. ``things`` are those in the way, or that it goes round. A robot that ``WAITS``
    goes round them at ``goes_round_at`` unless it is answered before; zero: it waits until they have gone. One that
    ``FINDS_NO_WAY`` searches again then. With ``continues`` the job goes on after the present drive, whatever the
    report of that says. ``drives`` counts those of the job so far. ``left_out`` are the stretches that are not painted,
    ``left_out_patches`` what is not covered: what can be reached is tried again at the end.
    """

    DRIVES: ClassVar[int] = 0
    WAITS: ClassVar[int] = 1
    PLANS: ClassVar[int] = 2
    FINDS_NO_WAY: ClassVar[int] = 3

    ros_type: ClassVar[str] = "touchline_msgs/msg/WayRound"
    header: Header = Header()
    state: UInt8 = 0
    things: tuple[str, ...] = ()
    goes_round_at: Time = Time()
    continues: bool = False
    drives: UInt32 = 0
    left_out: tuple[LeftOutStretch, ...] = ()
    left_out_patches: tuple[LeftOutPatch, ...] = ()
