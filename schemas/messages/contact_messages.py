"""Contacts of a robot with things, in truth."""

from typing import ClassVar

from touchline.schemas.messages.base import Message, UInt32
from touchline.schemas.messages.standard import Header, Time


class ThingContact(Message):
    """A contact with a thing: when, where, and with what energy.

    ``robot_mps`` is the speed of the robot's body at the place; 0 if the thing ran into the robot at rest.
    """

    ros_type: ClassVar[str] = "touchline_msgs/msg/ThingContact"
    stamp: Time = Time()
    thing: str = ""
    x_m: float = 0.0
    y_m: float = 0.0
    robot_mps: float = 0.0
    closing_mps: float = 0.0
    energy_j: float = 0.0


class ContactReport(Message):
    """Contacts of a traversal with things; a traversal with one ``while_moving`` is no success."""

    ros_type: ClassVar[str] = "touchline_msgs/msg/ContactReport"
    header: Header = Header()
    while_moving: UInt32 = 0
    contacts: tuple[ThingContact, ...] = ()
