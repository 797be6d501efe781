"""What the differential drive has of its own in the world's state and parameter arrays."""

from __future__ import annotations

from typing import Final

from touchline.services.robot_sim.world.body import ANGLES, DRIVE, P_DRIVE

LEFT_ANGLE: Final = ANGLES
RIGHT_ANGLE: Final = ANGLES + 1

# State.
LEFT_RATE: Final = DRIVE  # rad/s
RIGHT_RATE: Final = DRIVE + 1
LEFT_SLIP: Final = DRIVE + 2  # random share of ground speed lost; the tyres' own slip comes on top
RIGHT_SLIP: Final = DRIVE + 3
REFERENCE: Final = DRIVE + 4  # left, right: the drives' speed profile [rad/s]
TORQUE: Final = DRIVE + 6  # left, right: of the motors at the wheels [Nm]
INTEGRAL: Final = DRIVE + 8  # left, right: of the drives' controllers [Nm]
CASTER_X: Final = DRIVE + 10  # direction in which the casters roll, body frame, unit vector
CASTER_Y: Final = DRIVE + 11
LEFT_TRACTION: Final = DRIVE + 12  # N, of the tyres, in the last step
RIGHT_TRACTION: Final = DRIVE + 13
STATE_SIZE: Final = 14  # of these

# Parameters.
P_LEFT_RADIUS: Final = P_DRIVE
P_RIGHT_RADIUS: Final = P_DRIVE + 1
P_TRACK: Final = P_DRIVE + 2
P_MAX_RATE: Final = P_DRIVE + 3
P_MAX_ACCEL: Final = P_DRIVE + 4
P_LAG: Final = P_DRIVE + 5  # share of the difference to the command made up in one step
P_WHEEL_INERTIA: Final = P_DRIVE + 6  # kg m², motor's share included
P_TORQUE_PER_A: Final = P_DRIVE + 7  # Nm/A at the wheel, gear losses taken off
P_EMF: Final = P_DRIVE + 8  # V per rad/s of the wheel
P_RESISTANCE: Final = P_DRIVE + 9  # Ω
P_MAX_CURRENT: Final = P_DRIVE + 10
P_CURRENT_LAG: Final = P_DRIVE + 11  # share of that to the demanded torque made up in one step
P_FRICTION: Final = P_DRIVE + 12  # Nm, dry
P_VISCOUS: Final = P_DRIVE + 13  # Nm per rad/s
P_GAIN: Final = P_DRIVE + 14  # Nm per rad/s
P_INTEGRAL_GAIN: Final = P_DRIVE + 15  # Nm per rad
P_AHEAD_COMMON: Final = P_DRIVE + 16  # Nm per rad/s²: feed-forward of both wheels speeding up together
P_AHEAD_TURN: Final = P_DRIVE + 17  # and against each other
P_CASTER_X: Final = P_DRIVE + 18
P_CASTER_SHARE: Final = P_DRIVE + 19
P_CASTER_TRAIL: Final = P_DRIVE + 20
PARAMETER_SIZE: Final = 21  # of these
