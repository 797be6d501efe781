"""Array layout of the nominal-tick state: what `carry` passes to the kernels of `nominal_tick`."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ring = tuple[Floats, Floats, Floats, Floats, Floats, Floats, Floats]
Way = tuple[Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats]

# What is carried across, `Cruise.state`.
STILL: Final = 0  # Intake
ACCEL: Final = 1
RATE: Final = 2  # left, right
ANGLE: Final = 4  # left, right
FIX: Final = 6  # the last fix, as `GnssSample`
LAST_USED: Final = 13
FIRST_TICK: Final = 14
EXPECTED: Final = 15  # Hazards: left, right
TANK: Final = 17
FLOW_SUM: Final = 18
FLOW_VALVE: Final = 19
FLOW_TICKS: Final = 20
FLOW_COUNT: Final = 21
FLOW_FIRST: Final = 22  # in the ring of flows
ELAPSED: Final = 23  # Traversal
COMMAND: Final = 24  # left, right [rad/s], valve, disc
VALVE_AFTER: Final = 28  # the command's valve_after_s
SPRAYED_TO: Final = 29  # Sprayer
FALLS_FROM: Final = 30
FALLS_TO: Final = 31
SWITCH: Final = 32  # index of the actuation under the robot
OPEN: Final = 33  # whether the valve is to be open by the end of the coming tick
SWITCH_AT: Final = 34  # where the nozzle is when it has to change
NOZZLE_AT: Final = 35  # where the nozzle is, as `Job` has it
READING: Final = 36  # Intake: the newest IMU sample, gyro and accelerometer
RATE_THEN: Final = 42  # left, right, when it was last another one
STATE_SIZE: Final = 44

# Constants, `Cruise.constants`.
K_RADIUS: Final = 0
K_LAG: Final = 1
K_MAX_STEP: Final = 2
K_NOMINAL_L: Final = 3
K_SETTLE_TICKS: Final = 4
K_FENCE_MARGIN: Final = 5
K_BODY_RADIUS: Final = 6
K_LEG_END: Final = 7
K_VALVE_ON: Final = 8  # delays [s]
K_VALVE_OFF: Final = 9
K_FIX_AGE: Final = 10  # of a fix, to paint [s]
CONSTANTS: Final = 11

# Columns of a fix in `FIX`, and of what `take_in` is given.
F_STAMP: Final = 0
F_EAST: Final = 1
F_NORTH: Final = 2
F_VARIANCE: Final = 3
F_FIX: Final = 4
F_SATELLITES: Final = 5
F_AGE: Final = 6
FIX_COLUMNS: Final = 7
