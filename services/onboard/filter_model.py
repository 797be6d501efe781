"""The filter's states and the layout of its working arrays.

States (index, unit; "tick" is the 10 ms period):

| state | unit | model | source of the noise figure |
| --- | --- | --- | --- |
| EAST, NORTH | m | integrates the tick's mean speed; small random walk for side slip | grass, by distance |
| HEADING | rad, unwrapped | integrates the tick's mean yaw rate | – |
| SPEED | m/s, mean of the last tick | driven by the accelerometer less its bias | accelerometer density, vibration |
| YAW_RATE | rad/s, mean of the last tick | random walk | largest yaw acceleration of the wheels |
| GYRO_BIAS | rad/s | random walk | data sheet: turn-on bias, bias walk |
| ACCEL_BIAS | m/s² | random walk; holds gravity's part too, and turns with it on a slope | data sheet |
| ODOMETRY_ERROR (2) | by the drive | Gauss-Markov about its mean: slip; offset of a steering | grass; vehicle |
| MAG_BIAS | rad | Gauss-Markov plus a walk with rotation (hard iron moves with heading) | data sheet |
| GNSS_EAST, GNSS_NORTH | m | Gauss-Markov: the slow part of the RTK error | quantiles of a moving receiver |

The slow GNSS error is what keeps the filter honest: averaging a hundred fixes does not make a centimetre into a
millimetre when their errors are the same error.

Beside the states five figures are learned that change too slowly to be states (`estimation/calibration`): the slope of
the ground (two), the bias of the accelerometer's left axis, and the means of the two errors of odometry:
the slip of a wheel, which holds its radius error.
"""

from __future__ import annotations

from typing import Final

EAST: Final = 0
NORTH: Final = 1
HEADING: Final = 2
SPEED: Final = 3
YAW_RATE: Final = 4
GYRO_BIAS: Final = 5
ACCEL_BIAS: Final = 6
ODOMETRY_ERROR: Final = 7  # two, of the drive
MAG_BIAS: Final = 9
GNSS_EAST: Final = 10
GNSS_NORTH: Final = 11
STATES: Final = 12

RING: Final = 64
"""Ticks of history kept for late fixes [0.64 s]."""

# One tick's measurements other than GNSS, kept in the ring for replay; nan where there is none.
IN_GYRO: Final = 0  # rad/s, mean of the tick
IN_ACCEL: Final = 1  # m/s², mean of this tick and the one before: what the mean speed changed by
IN_ODOMETRY: Final = 2  # two, of the drive, means of the tick: nominal rim speeds [m/s]
IN_STILL: Final = 4  # 1 while nothing of the drive has moved for a while
IN_MAG: Final = 5  # rad, magnetic heading
IN_SPAN: Final = 6  # ticks over which those of IN_ODOMETRY are means
IN_SIDE: Final = 7  # m/s², of the accelerometer's left axis
# What the tick is run with of that which is learned beside the states; nan before the filter has started.
IN_RISE_EAST: Final = 8  # m/s²: gravity times the ground's rise over run
IN_RISE_NORTH: Final = 9
IN_RISE_VAR: Final = 10  # (m/s²)², of both axes together
IN_ERROR_MEAN: Final = 11  # two: about which the errors of odometry vary
IN_SMOOTH: Final = 13  # two, of the drive: what the errors of odometry are a share of
IN_REFUSED: Final = 15  # ticks in a row, up to this one, in which the encoders' readings were rejected
IN_ROUGH: Final = 16  # (m/s²)², mean square step of IN_ACCEL over the last ticks
IN_DISPUTED: Final = 17  # ticks in a row, up to this one, in which the accelerometer contradicted wheels that stand
INPUTS: Final = 18

# What is learned beside the states.
SIDE_BIAS: Final = 0  # m/s²
RISE_EAST: Final = 1  # m/s²: gravity times the ground's rise over run
RISE_NORTH: Final = 2
P_BIAS: Final = 3  # covariance of these three
P_BIAS_EAST: Final = 4
P_BIAS_NORTH: Final = 5
P_EAST: Final = 6
P_EAST_NORTH: Final = 7
P_NORTH: Final = 8
ERROR_MEAN: Final = 9  # two: about which the errors of odometry vary
MEAN_VAR: Final = 11  # two
SLOW: Final = 13

# One fix in the ring.
FIX_USED: Final = 0
FIX_EAST: Final = 1
FIX_NORTH: Final = 2
FIX_VARIANCE: Final = 3  # m², of the white part, its tail included
FIX_AFTER: Final = 4  # s from the slot's tick to the stamp
FIXES: Final = 5

# Noise figures and constants, see `estimation/noise`.
C_ANTENNA_X: Final = 0
C_ANTENNA_Y: Final = 1
C_Q_SPEED: Final = 2  # variance added per tick
C_Q_YAW: Final = 3
C_Q_GYRO_BIAS: Final = 4
C_Q_ACCEL_BIAS: Final = 5
C_MAG_DECAY: Final = 6
C_MAG_VAR: Final = 7
C_GM_DECAY: Final = 8
C_GM_VAR: Final = 9
C_R_GYRO: Final = 10
C_R_MAG: Final = 11
C_R_GNSS: Final = 12
C_Q_SIDE: Final = 13  # m² of side slip per metre travelled
C_MAST: Final = 14  # s²: height of the antenna over gravity
C_RISE_VAR: Final = 15  # (m/s²)²: at the start
C_Q_RISE: Final = 16  # per metre
C_SIDE_BIAS_VAR: Final = 17
C_Q_SIDE_BIAS: Final = 18  # per tick
C_R_SIDE: Final = 19
C_SIDE_SLIP: Final = 20  # rad of slip angle per m/s² of lateral acceleration
C_SLIP_DECAY: Final = 21  # this and the next three: two, of the errors of odometry
C_SLIP_VAR: Final = 23
C_MEAN_SLIP_VAR: Final = 25
C_R_MEAN_SLIP: Final = 27  # of one fix's slip as a sample of the mean
FIGURES: Final = 29

# Counters the kernel keeps.
N_FIXES: Final = 0
N_FIX_REJECTED: Final = 1
N_FIX_OUTLYING_RUN: Final = 2  # in a row, used or not
N_FIX_LATE: Final = 3
N_FIX_DUPLICATE: Final = 4
N_RECOVERIES: Final = 5
N_ENCODER: Final = 6
N_ENCODER_REJECTED: Final = 7
N_ENCODER_REJECTED_RUN: Final = 8
N_MAG: Final = 9
N_MAG_REJECTED: Final = 10
NIS_FIX_SUM: Final = 11  # of fixes as they are weighed, each at most FIX_DOF + 2
NIS_ENCODER_SUM: Final = 12
NIS_MAG_SUM: Final = 13
NIS_FIX_LAST: Final = 14
INNOVATION_EAST: Final = 15
INNOVATION_NORTH: Final = 16
NIS_FIX_RECENT: Final = 17  # exponential mean over about the last ten fixes that were used
N_FIX_OUT_OF_ORDER: Final = 18
ENCODER_REJECTED_RECENT: Final = 19  # share, exponential over about 0.3 s: the slip test
N_GYRO_REJECTED: Final = 20  # at standstill: it turns, the wheels do not
FIX_DOUBT: Final = 21  # −ln of how likely an honest receiver's fixes are as outlying as those of the present run
COUNTERS: Final = 22

GATE_1_DOF: Final = 15.14  # χ², 99.99 %
GATE_2_DOF: Final = 18.42
FIX_DOF: Final = 3.5
"""Degrees of freedom of the Student-t distribution that the receiver's white errors are taken to have: a bivariate t
with these that has 68 % of the horizontal errors within 7 mm has 95.45 % within 16.0 mm and 99.73 % within 38.7 mm. The
published field test of the receiver has 7/17/38 mm (docs/robot-sim.md)."""
