"""Layout of `now` (NOW,): the tracking errors and the robot's motion, as followers are given them."""

from __future__ import annotations

from typing import Final

from touchline.onboard.interface import ACTUATORS

LATERAL: Final = 0  # drive's origin to the robot's left of the path [m]
HEADING_ERROR: Final = 1  # rad, robot less path
NOZZLE_LATERAL: Final = 2  # nozzle left of its own path [m]
SPEED: Final = 3
YAW_RATE: Final = 4
REFERENCE_SPEED: Final = 5  # of the robot, negative when it reverses
EFFECT: Final = 6  # two numbers by which the drive converts actuators and twist into each other

# Of a reference that moves by time, seen from the robot's frame; all 0 for followers that are not timed.
ALONG: Final = 8  # how far it is ahead [m]
ACROSS: Final = ALONG + 1  # how far it is to the left [m]
TURN: Final = ALONG + 2  # its heading less the robot's [rad]
REFERENCE_ACCELERATION: Final = ALONG + 3  # by which its speed has changed in the last tick, signed as that [m/s²]

COMMAND: Final = ALONG + 4  # of the actuators, in force during the last tick: all the rest
NOW: Final = COMMAND + ACTUATORS
