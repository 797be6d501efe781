"""Layout of `now` (NOW,): the tracking errors and the robot's motion, the inputs of followers."""

from __future__ import annotations

from typing import Final

from touchline.onboard.interface import ACTUATORS

LATERAL: Final = 0  # drive's origin to the robot's left of the path [m]
HEADING_ERROR: Final = 1  # rad, robot less path
NOZZLE_LATERAL: Final = 2  # nozzle left of its own path [m]
SPEED: Final = 3
YAW_RATE: Final = 4
REFERENCE_SPEED: Final = 5  # of the robot, negative when it reverses
EFFECT: Final = 6  # two factors by which the drive converts between actuators and twist

# Errors against a reference that moves by time, in the robot's frame; all 0 for followers that are not timed.
ALONG: Final = 8  # reference ahead of the robot [m]
ACROSS: Final = ALONG + 1  # reference to the left of the robot [m]
TURN: Final = ALONG + 2  # heading of the reference less the robot's [rad]
REFERENCE_ACCELERATION: Final = ALONG + 3  # change of its speed in the last tick, signed as that [m/s²]

COMMAND: Final = ALONG + 4  # commands of the actuators in force during the last tick: all the rest
NOW: Final = COMMAND + ACTUATORS
