"""The filter's states, and the records of its ring: what is measured in a tick, and what is learned and counted.

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
| GNSS_EAST, GNSS_NORTH | m | Gauss-Markov: the correlated part of the RTK error | quantiles of a moving receiver |
| GYRO_SCALE | share | constant: reading over the true rate, less what the files say | configuration |
| ANTENNA_X, ANTENNA_Y | m | constant: place of the antenna in the body, less what the files say | configuration |
| STAMP_OFFSET | s | constant: time of a fix's measurement less its stamp, less what the files say | configuration |

Correlated GNSS errors are what keeps the filter honest: averaging a hundred fixes does not make a centimetre into a
millimetre when their errors are the same error. Of two such errors the one that lasts for seconds is these states; the
one that lasts for minutes cannot be told from the position, whose covariance contains it (`FilterFigures.slow_var`).
The constants do the same for what the files say of the robot: they are estimated where its motion tells them, and
considered in the covariance until then.

Beside the states five figures are learned that change too slowly to be states (`estimation/calibration`): the slope of
the ground (two), the bias of the accelerometer's left axis, and the means of the two errors of odometry:
the slip of a wheel, which holds its radius error.
"""

from __future__ import annotations

import math
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.records import Record, RecordArray

Floats = NDArray[np.float64]

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
GYRO_SCALE: Final = 12
ANTENNA_X: Final = 13
ANTENNA_Y: Final = 14
STAMP_OFFSET: Final = 15
STATES: Final = 16
VARYING: Final = GYRO_SCALE
"""Number of states that vary; those behind are constants of the robot."""
CONSTANTS: Final = slice(VARYING, STATES)

MOST_UPDATES: Final = 8
"""Largest number of scalar measurements of auxiliary sensors that are used in a tick."""
UPDATE_VALUE: Final = STATES
"""Column of the value of such a measurement, after the row of its Jacobian."""
UPDATE_VARIANCE: Final = STATES + 1
UPDATE_COLUMNS: Final = STATES + 2

RING: Final = 64
"""Ticks of history kept for late fixes [0.64 s]."""

FIX_LAG: Final = 6
"""Distance of the innovations whose correlation tells whether the filter is consistent, in fixes. A burst of the
receiver's errors correlates those that are nearer."""

GATE_1_DOF: Final = 15.14  # χ², 99.99 %
GATE_2_DOF: Final = 18.42
FIX_DOF: Final = 3.5
"""Degrees of freedom of the Student-t distribution assumed for the receiver's white errors: a bivariate t with these
that has 68 % of the horizontal errors within 7 mm has 95.45 % within 16.0 mm and 99.73 % within 38.7 mm. The published
field test of the receiver has 7/17/38 mm (docs/explanation/robot-sim.md)."""
POSE_DOF: Final = 10.0
"""The same for a camera's poses: nearly normal, yet an outlier, as of a robot taken for another, counts little: one
that is a metre off with σ 1 cm counts as a thousandth of a good one."""


class TickInputs(Record):
    """A tick's measurements other than GNSS, kept in the ring for replay; nan where there is none."""

    gyro_radps: float = math.nan
    """Mean of the tick."""
    accel_mps2: float = math.nan
    """Mean of this tick and the one before: the rate of change of the mean speed."""
    pitch_radps: float = math.nan
    """Reading of the gyro about the left axis, mean of the tick."""
    side_mps2: float = math.nan
    """Acceleration along the accelerometer's left axis."""
    mag_rad: float = math.nan
    """Magnetic heading."""
    odometry: Annotated[Floats, 2] = np.full(2, math.nan)
    """Both numbers of the drive, means of the tick, in its units, such as nominal rim speeds [m/s]."""
    span_ticks: int
    """Ticks over which `odometry` is averaged."""
    still: bool
    """True if nothing of the drive has moved for a while."""

    rise_east_mps2: float = math.nan
    """Gravity times the ground's rise over run. This and the next four are the learned figures with which the tick is
    run; nan before the filter has started."""
    rise_north_mps2: float = math.nan
    rise_var: float = math.nan
    """Variance of both axes together, (m/s²)²."""
    waves_var: float
    """`LearnedFigures.waves_var`, at least 0."""
    error_mean: Annotated[Floats, 2] = np.full(2, math.nan)
    """Means about which the errors of odometry vary."""

    smooth: Annotated[Floats, 2] = np.full(2, math.nan)
    """Values of the drive that the errors of odometry are a share of."""
    refused_ticks: int
    """Consecutive ticks, up to this one, in which the encoders' readings were rejected."""
    lean: Annotated[Floats, 2]
    """Innovations of `odometry` in units of their σ, means over about the last half second: 0 but for chance."""
    disputed_ticks: int
    """Consecutive ticks, up to this one, in which the accelerometer contradicted standing wheels."""
    rough: float
    """Mean square step of `accel_mps2` over the last ticks, (m/s²)²."""
    pitch_means_radps: Annotated[Floats, 2] = np.full(2, math.nan)
    """Means of `pitch_radps`, over about 0.1 and 1 s."""
    pitching: float
    """Mean square of their difference over the last second, (rad/s)²."""
    wander: float
    """`BlindRun.wander` with which the tick is run."""


class LearnedFigures(Record):
    """Figures that are learned beside the states."""

    side_bias_mps2: float
    rise_east_mps2: float
    """Gravity times the ground's rise over run."""
    rise_north_mps2: float
    bias_var: float
    """Covariance of these three, (m/s²)²: this and the next five."""
    bias_east: float
    bias_north: float
    east_var: float
    east_north: float
    north_var: float
    side_mean_mps2: float
    """Mean of the left axis' reading beyond what these three explain, over the last second: waves vary about it, and a
    yaw rate that is wrong moves it."""
    waves_var: float
    """Variance of the left axis' reading about that mean beyond what the sensor explains, (m/s²)²: that of gravity's
    part across on waves of the ground. Negative where it reads less than expected."""
    error_mean: Annotated[Floats, 2]
    """Means about which the errors of odometry vary."""
    mean_var: Annotated[Floats, 2]
    """Variances of these means."""
    constants: Annotated[Floats, 4]
    """Constants of the robot with which the filter starts, less what the files say; 0 but after a start before."""
    constant_var: Annotated[Floats, 4]
    """Their variances."""
    start_east_m: float
    """Position at which the filter started, with the next field; the distance from it shows the unknown scale of
    odometry."""
    start_north_m: float


class FixInTick(Record):
    """A fix in the tick in which it is valid."""

    used: bool
    east_m: float
    north_m: float
    variance_m2: float
    """Variance of the white part, its tail included."""
    after_s: float
    """Time from the tick to the stamp."""
    heading_rad: float = math.nan
    """Heading of a camera's pose; nan if it has none."""
    heading_variance_rad2: float
    strayed_m: float
    """Distance by which the estimate has strayed from the fix, and which is added to its σ before the fix is used."""


class BlindRun(Record):
    """A second filter that is given no fixes for some seconds, and what it has shown; see `estimation/adaptation`."""

    span_ticks: int
    """Length of the present run."""
    ticks: int
    """Ticks since it was last set to the estimate; 0 if it is not run."""
    recoveries: int
    """`FilterCounters.recoveries` then."""
    wander: float
    """Unmodelled motion, as a multiple of that in `adaptation`; 0 as long as nothing contradicts the noise figures."""
    wander_most: float
    """Largest of them so far."""
    states: Annotated[Floats, 2, STATES]
    """Posterior of the tick before and of the present one, with covariances and inputs."""
    covariances: Annotated[Floats, 2, STATES, STATES]
    inputs: Annotated[RecordArray[TickInputs], 2]


class FilterFigures(Record):
    """Noise figures and constants, see `estimation/noise`.

    Fields named q are variances that are added to a state in each tick unless noted otherwise; fields named r are
    variances of a measurement.
    """

    antenna_x_m: float
    antenna_y_m: float
    mast_s2: float
    """Height of the antenna over gravity."""
    q_speed: float
    q_yaw_rate: float
    q_gyro_bias: float
    q_accel_bias: float
    q_side_m: float
    """Variance of side slip per metre travelled, m²/m."""
    mag_decay: float
    """Share of the magnetometer's error that remains after a tick."""
    mag_var: float
    gnss_decay: float
    """The same for the correlated part of the GNSS error."""
    gnss_var: float
    slow_var: float
    """Variance of a GNSS error that is too slow to be a state, which the position's covariance contains."""
    q_slow: float
    """Variance by which that error changes in a tick."""
    burst_var: float
    """Variance of the correlated part of the GNSS error in a burst; 0: it has none."""
    fix_news: float = 1.0
    """Share of what a fix in a row of outlying ones says that the one before has not said."""
    gyro_scale: float = 1.0
    """Reading of the gyro over the true rate."""
    stamp_offset_s: float
    """Time of a fix's measurement less its stamp."""
    constant_var: Annotated[Floats, 4]
    """Variances at the start of what the files say of the constants, in the order of the states."""
    considered: int = STATES
    """Constant that fixes do not teach; `STATES`: none."""
    crab_var: float
    """Variance of the angle between heading and course beyond the known side slip; that is considered only."""
    q_constant: Annotated[Floats, 4]
    """Variances that are added to them: they change with temperature and load."""
    r_gyro: float
    r_mag: float
    r_gnss: float
    """Variance of the white part of a fix, its tail included, or of a camera's pose."""
    r_heading: float
    """Variance of a camera's heading."""
    adapts: bool = True
    """True if the claimed σ grows with what innovations show, see `estimation/adaptation`."""
    fix_doubt_most: float
    """`FilterCounters.fix_doubt` from which fixes are rejected."""
    fix_dof: float
    """Degrees of freedom of the distribution of fixes and camera poses."""
    scale_var: float
    """Variance of the relative error of distances by odometry that nothing can observe."""
    r_side: float
    """Variance of the accelerometer's left axis."""
    rise_var: float
    """Variance of the slope at the start, (m/s²)²."""
    q_rise: float
    """Variance that is added to the slope per metre."""
    side_bias_var: float
    """Variance at the start."""
    q_side_bias: float
    side_slip_rad_per_mps2: float
    """Side slip angle per lateral acceleration."""
    slip_decay: Annotated[Floats, 2]
    """Share of the errors of odometry that remains after a tick; this and the next three have one number for each."""
    slip_var: Annotated[Floats, 2]
    mean_slip_var: Annotated[Floats, 2]
    """Variance of their means at the start."""
    r_mean_slip: Annotated[Floats, 2]
    """Variance of one fix's slip as a sample of the mean."""


class FilterCounters(Record):
    """Counters of the filter's kernels, and the fit of its measurements."""

    fixes: int
    """Used fixes."""
    fixes_rejected: int
    fixes_outlying_run: int
    """Consecutive outlying fixes, used or not."""
    fix_step_m: float
    """Change of the last fix's innovation from the one before: what the receiver moved beyond odometry."""
    outlying_step_m: float
    """Largest of those in the present run of outlying fixes: about its innovation if the receiver has jumped, far less
    if the estimate has drifted away."""
    strays: int
    """Number of times at which the estimate had strayed from the fixes without any jump in them."""
    stray_most_m: float
    """Largest distance by which it had."""
    contradicted_m: float
    """Distance driven since fixes began to be rejected."""
    fixes_late: int
    fixes_duplicate: int
    fixes_out_of_order: int
    recoveries: int
    encoders: int
    """Used encoder readings; `mags` are those of the magnetometer."""
    encoders_rejected: int
    encoders_rejected_run: int
    encoders_rejected_recent: float
    """Share of rejected readings, exponential over about 0.3 s: the slip test."""
    mags: int
    mags_rejected: int
    headings: int
    """Used headings of a camera's poses."""
    headings_rejected: int
    gyro_rejected: int
    """Rejected gyro readings at standstill: the gyro reads a rotation, the wheels none."""
    fix_nis_sum: float
    """Sum of the NIS of fixes as they are weighed, each at most `fix_dof` + 2."""
    fix_nis_last: float
    fix_nis_recent: float
    """Exponential mean over about the last ten fixes that were used."""
    fix_doubt: float
    """−ln of the probability that an honest receiver's fixes are as outlying as those of the present run."""
    encoder_nis_sum: float
    mag_nis_sum: float
    heading_nis_sum: float
    innovation_east_m: float
    """Innovation of the last fix."""
    innovation_north_m: float

    fix_white_0: float = math.nan
    """Innovation of the last fix that arrived in the tick, east, over its standard deviation; nan if there is none.

    With the next one it is what a consistent filter leaves: independent from one to the next, mean 0 and variance 1.
    The variance is that of the data sheet, unweighed.
    """
    fix_white_1: float = math.nan
    """The same of the part of north that is independent of it."""
    fix_before: Annotated[Floats, FIX_LAG, 2]
    """`fix_white_0` and `fix_white_1` of the moving robot's last fixes, bounded; a ring."""
    fixes_noted: int
    """Fixes that have been entered there."""
    fix_cross: float
    """Mean product of innovations that are `Estimator.fix_lag` fixes apart, see `estimation/consistency_monitor`."""
    fix_power: float
    """Mean square of them, both axes together."""
    inconsistent: bool
    """True if those innovations are correlated, so that the claimed covariance is not to be believed."""
    fix_aside: float
    """Mean square of the sum of the last `FIX_LAG` innovations across the heading, over their number."""
    fix_along: float
    """The same along the heading."""
    fix_unrest: float
    """Largest of those so far over what right files leave; 0 until it is known.

    Above 1 the robot or the receiver is not as the noise figures say: constants are less certain than they seem.
    """
    fix_log_det: float = math.nan
    """ln det S of that fix's innovation, S in m²."""
    differing: int
    """Constants that differ from the robot's files for certain, a bit each, in the order of the states."""
