"""Actuators of a drive: names, quantities and limits."""

from typing import NamedTuple


class Actuator(NamedTuple):
    """One wheel or joint of a drive that is commanded.

    Attributes:
        name: Tells it from the drive's others: ``"left"``.
        quantity: What of it is commanded: ``"wheel speed"``, ``"steering angle"``.
        unit: Of that, ``"rad/s"`` or ``"rad"``.
        rate: What its change over time is called: ``"wheel acceleration"``; its unit is that per second.
        limit: The largest absolute value.
        rate_limit: The largest absolute change, per second.
        joint: Its name among the joint states.
        encoder_rad: Between two counts of its encoder, whose readings are its angle.
    """

    name: str
    quantity: str
    unit: str
    rate: str
    limit: float
    rate_limit: float
    joint: str
    encoder_rad: float
