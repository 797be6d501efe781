"""What the rear-steered drive has of its own in the world's state and parameter arrays."""

from __future__ import annotations

from typing import Final

from touchline.services.robot_sim.world.body import ANGLES, DRIVE, P_DRIVE

DRUM_ANGLE: Final = ANGLES
STEERING: Final = ANGLES + 1  # as its encoder sees it: positive turns the wheel to the left

# State.
DRUM_RATE: Final = DRIVE  # rad/s
DRUM_SLIP: Final = DRIVE + 1  # random share of ground speed lost; the drum's own slip comes on top
REFERENCE: Final = DRIVE + 2  # the drum's speed profile [rad/s]
TORQUE: Final = DRIVE + 3  # of the motor at the drum [Nm]
INTEGRAL: Final = DRIVE + 4  # of its controller [Nm]
TRACTION: Final = DRIVE + 5  # N, of the drum, in the last step
SIDE_FORCE: Final = DRIVE + 6  # N, of the steered wheel across itself, in the last step
STATE_SIZE: Final = 7  # of these

# Parameters.
P_RADIUS: Final = P_DRIVE
P_BASE: Final = P_DRIVE + 1  # m, from axle to axle
P_BEHIND: Final = P_DRIVE + 2  # m, of the centre of mass behind the drum's axle
P_DRUM_SHARE: Final = P_DRIVE + 3  # of the weight
P_OFFSET: Final = P_DRIVE + 4  # rad, of the wheel beyond its encoder's angle
P_STOP: Final = P_DRIVE + 5  # rad, where the steering ends
P_STEERING_STEP: Final = P_DRIVE + 6  # rad, at most in one step
P_STEERING_LAG: Final = P_DRIVE + 7  # share of the way to the command in one step
P_MAX_RATE: Final = P_DRIVE + 8
P_MAX_STEP: Final = P_DRIVE + 9  # rad/s, of the drum's profile in one step
P_LAG: Final = P_DRIVE + 10
P_INERTIA: Final = P_DRIVE + 11  # kg m², motor's share included
P_TORQUE_PER_A: Final = P_DRIVE + 12  # Nm/A at the drum, gear losses taken off
P_EMF: Final = P_DRIVE + 13  # V per rad/s of the drum
P_RESISTANCE: Final = P_DRIVE + 14  # Ω
P_MAX_CURRENT: Final = P_DRIVE + 15
P_CURRENT_LAG: Final = P_DRIVE + 16
P_FRICTION: Final = P_DRIVE + 17  # Nm, dry
P_VISCOUS: Final = P_DRIVE + 18  # Nm per rad/s
P_AHEAD: Final = P_DRIVE + 19  # Nm per rad/s²: feed-forward of drum and mass speeding up
P_GAIN: Final = P_DRIVE + 20  # Nm per rad/s
P_INTEGRAL_GAIN: Final = P_DRIVE + 21  # Nm per rad
P_INTEGRAL_LIMIT: Final = P_DRIVE + 22  # Nm
PARAMETER_SIZE: Final = 23  # of these
