"""Batch reference: the track that fits all of a recording best, the later fixes included.

Least squares over a pose every fifth of a second, with the gyro's bias, the wheels' slip and the slow error of the
fixes, each linked to the next by odometry (factor graph: F. Dellaert and M. Kaess, "Factor Graphs for Robot
Perception", Foundations and Trends in Robotics 6(1–2), 2017). Gauss–Newton, in which outlying fixes and odometry
weigh less from round to round (Student-t weights: K. Lange and others, J. American Statistical Association 84, 1989).
It shares the estimator's noise figures, but neither its states nor its gates. Drives with two wheels only.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded

from touchline.checking.estimating.estimator_run import EstimatorRun
from touchline.core.angles import wrapped_all
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.estimation.aiding.gnss_aiding import FIX_FIXED
from touchline.onboard.estimation.frame_series import FrameSeries
from touchline.onboard.estimation.noise import noise_figures
from touchline.onboard.filter_model import FIX_DOF, FilterFigures
from touchline.onboard.interface import ANGLES, GYRO, TICK_S, TICKS_PER_S
from touchline.schemas.vehicles.differential_drive import DifferentialDrive

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

STEP_TICKS: Final = 20
"""Ticks from one pose to the next."""
_STATES: Final = 7
_EAST, _NORTH, _HEADING, _BIAS, _SLIP, _SLOW = range(6)  # the slow error has two
_ROUNDS: Final = 12
_ODOMETRY_DOF: Final = 4.0
_ODOMETRY_FLOOR_M2: Final = 0.00005**2
_SLIP_VAR: Final = 0.01**2
_SLIP_WALK: Final = 0.0005**2  # per second
_BIAS_VAR: Final = 0.01**2
_LOOSE_M2: Final = 1.0


class Smoothed(NamedTuple):
    """Smoothed track.

    Attributes:
        ticks: (n,) ticks of its poses.
        poses: (n, 3) east, north [m] and heading [rad].
    """

    ticks: Integers
    poses: Floats


class _Odometry(NamedTuple):
    """Motion by wheels and gyro.

    Attributes:
        moved: (n − 1, 3) from each pose to the next, in the frame of the first: forward, left [m], turn [rad].
        variance: (n − 1, 3) of them.
        within: (n, STEP_TICKS + 1, 3) motion from each pose to each tick until the next.
    """

    moved: Floats
    variance: Floats
    within: Floats


class _Fixes(NamedTuple):
    """RTK-fixed positions.

    Attributes:
        node: (k,) pose before each.
        arm: (k, 2) antenna in the frame of that pose [m].
        place: (k, 2) east and north [m].
        variance: (k,) of the white part, its tail included [m²].
    """

    node: Integers
    arm: Floats
    place: Floats
    variance: Floats


def smoothed(run: EstimatorRun, frames: FrameSeries) -> Smoothed | None:
    """Return the smoothed track of a recording, from the estimator's start on; None if there is too little of it.

    Args:
        run: The estimator's run, from whose track it begins.
        frames: Sensor frames.
    """
    drive = run.setup.vehicle.drive
    if not run.starts_s or not isinstance(drive, DifferentialDrive):
        return None
    ticks = np.arange(round(run.starts_s[-1] * TICKS_PER_S) + 1, len(run.poses) - STEP_TICKS, STEP_TICKS)
    if len(ticks) < 2:
        return None
    onboard = run.setup.onboard
    figures = noise_figures(run.setup.vehicle, onboard, drive_of(run.setup.vehicle, onboard.drive.track_width_relative))
    odometry = _odometry(run, frames, ticks, figures)
    problem = _Problem(odometry, _fixes(run, frames, ticks, odometry, figures), figures)
    return Smoothed(ticks, problem.solved(run.poses[ticks]))


def distance_in_sigma(run: EstimatorRun, track: Smoothed) -> float:
    """Return the estimate's distance from a smoothed track, over its σ, rms per axis: 1 at most if that is true."""
    off = run.poses[track.ticks, :2] - track.poses[:, :2]
    squared = np.einsum("ni,nij,nj->n", off, np.linalg.inv(run.covariances[track.ticks, :2, :2]), off)
    return float(np.sqrt(0.5 * squared.mean()))


def _sampled(frames: FrameSeries, first: int, last: int, kind: int, columns: slice) -> Floats:
    """Return readings by the tick in which they were measured, `first` to `last`, or the last one before."""
    row = frames.measured[:, kind] - first
    inside = (row >= 0) & (row <= last - first)
    readings = np.full((last - first + 1, columns.stop - columns.start), np.nan)
    readings[row[inside]] = frames.readings[inside, columns]
    filled = np.maximum.accumulate(np.where(np.isfinite(readings).all(axis=1), np.arange(len(readings)), 0))
    return cast("Floats", readings[filled])


def _odometry(run: EstimatorRun, frames: FrameSeries, ticks: Integers, c: FilterFigures) -> _Odometry:
    drive, sheet = run.setup.vehicle.drive, run.setup.onboard
    first, last = int(ticks[0]), int(ticks[-1]) + STEP_TICKS
    angles = _sampled(frames, first, last, 2, slice(ANGLES, ANGLES + 2))
    rims = np.nan_to_num(np.diff(angles, axis=0)) * drive.wheel_radius_m
    step_m, turn = rims.mean(axis=1), (rims[:, 1] - rims[:, 0]) / drive.track_width_m
    gyro = _sampled(frames, first, last, 0, slice(GYRO + 2, GYRO + 3))[1:, 0] / c.gyro_scale * TICK_S
    by_gyro = np.isfinite(gyro)
    turn = np.where(by_gyro, gyro, turn)
    steps = len(ticks)
    step_m, turn = step_m[: steps * STEP_TICKS].reshape(steps, -1), turn[: steps * STEP_TICKS].reshape(steps, -1)
    turned = np.cumsum(turn, axis=1)
    course = turned - 0.5 * turn - c.side_slip_rad_per_mps2 * step_m * turn / TICK_S**2
    forward, left = (np.cumsum(step_m * part(course), axis=1) for part in (np.cos, np.sin))
    within = np.zeros((steps, STEP_TICKS + 1, 3))
    within[:, 1:] = np.stack((forward, left, turned), axis=2)
    way_m, span_s = np.abs(step_m).sum(axis=1)[:-1], STEP_TICKS * TICK_S
    walk = run.wander_most_m_rtm**2
    slip = 2.0 * sheet.drive.slip_tau_s * (sheet.drive.slip_relative * way_m) ** 2 / span_s
    turn_var = sheet.imu.gyro_density_radps_rthz**2 * span_s if by_gyro.any() else (0.05 * turn).sum(axis=1)[:-1] ** 2
    variance = np.column_stack(
        (
            slip + walk * way_m + _ODOMETRY_FLOOR_M2,
            (c.q_side_m + walk) * way_m + _ODOMETRY_FLOOR_M2,
            turn_var + 1e-3 * walk * way_m + 1e-9,
        )
    )
    return _Odometry(within[:-1, -1], variance, within)


def _fixes(run: EstimatorRun, frames: FrameSeries, ticks: Integers, odometry: _Odometry, c: FilterFigures) -> _Fixes:
    fixes = cast("NDArray[Any]", frames.fixes)
    fixes = fixes[fixes["fix"] == FIX_FIXED]
    # A tick's state is at its end.
    at = (fixes["stamp_s"] + c.stamp_offset_s) * TICKS_PER_S - ticks[0]
    inside = (at >= 0.0) & (at < len(ticks) * STEP_TICKS - 1)
    fixes, at = fixes[inside], at[inside]
    node, below = (at // STEP_TICKS).astype(np.int64), (at % STEP_TICKS).astype(np.int64)
    share = (at % STEP_TICKS - below)[:, None]
    moved = (1.0 - share) * odometry.within[node, below] + share * odometry.within[node, below + 1]
    cos, sin = np.cos(moved[:, 2]), np.sin(moved[:, 2])
    arm = moved[:, :2] + np.column_stack(
        (cos * c.antenna_x_m - sin * c.antenna_y_m, sin * c.antenna_x_m + cos * c.antenna_y_m)
    )
    variance = c.r_gnss + np.maximum(fixes["variance_m2"] - c.r_gnss - c.gnss_var, 0.0)
    return _Fixes(node, arm, np.column_stack((fixes["east_m"], fixes["north_m"])), variance)


class _Problem:
    """Weighted least squares over all poses."""

    def __init__(self, odometry: _Odometry, fixes: _Fixes, c: FilterFigures) -> None:
        self._odometry, self._fixes, self._c = odometry, fixes, c
        span_s = STEP_TICKS * TICK_S
        kept = c.gnss_decay**STEP_TICKS
        self._kept = np.array([1.0, 1.0, kept, kept])
        walks = (c.q_gyro_bias * STEP_TICKS, _SLIP_WALK * span_s, *(c.gnss_var * (1.0 - kept**2),) * 2)
        self._walk_information = 1.0 / np.array(walks)

    def solved(self, start: Floats) -> Floats:
        """Return the poses (n, 3) of least squares, beginning with others."""
        x = np.zeros((len(start), _STATES))
        x[:, :3] = start
        anchor = x[0].copy()
        for _ in range(_ROUNDS):
            diagonal = np.zeros((len(x), _STATES, _STATES))
            below = np.zeros((len(x) - 1, _STATES, _STATES))
            slope = np.zeros_like(x)
            prior = 1.0 / np.array(
                (_LOOSE_M2, _LOOSE_M2, 1.0, _BIAS_VAR, _SLIP_VAR, self._c.gnss_var, self._c.gnss_var)
            )
            diagonal[0] += np.diag(prior)
            slope[0] += prior * (anchor - x[0])
            self._add_walks(x, diagonal, below, slope)
            self._add_odometry(x, diagonal, below, slope)
            self._add_fixes(x, diagonal, slope)
            x += _banded(diagonal, below, slope)
        return x[:, :3]

    def _add_walks(self, x: Floats, diagonal: Floats, below: Floats, slope: Floats) -> None:
        """Link biases, slips and slow errors to the next ones."""
        own = np.arange(_BIAS, _STATES)
        residual = x[1:, own] - self._kept * x[:-1, own]
        information = self._walk_information
        diagonal[1:, own, own] += information
        diagonal[:-1, own, own] += information * self._kept**2
        below[:, own, own] -= information * self._kept
        slope[1:, own] -= information * residual
        slope[:-1, own] += information * self._kept * residual

    def _add_odometry(self, x: Floats, diagonal: Floats, below: Floats, slope: Floats) -> None:
        """Link poses to the next ones."""
        moved, span_s = self._odometry.moved, STEP_TICKS * TICK_S
        cos, sin = np.cos(x[:-1, _HEADING]), np.sin(x[:-1, _HEADING])
        way = np.diff(x[:, :2], axis=0)
        ahead, aside = cos * way[:, 0] + sin * way[:, 1], cos * way[:, 1] - sin * way[:, 0]
        turned = wrapped_all(np.diff(x[:, _HEADING]) - moved[:, 2] + x[:-1, _BIAS] * span_s)
        residual = np.column_stack((ahead - moved[:, 0] * (1.0 - x[:-1, _SLIP]), aside - moved[:, 1], turned))
        of_first, of_next = np.zeros((2, len(way), 3, _STATES))
        of_next[:, 0, _EAST], of_next[:, 0, _NORTH] = cos, sin
        of_next[:, 1, _EAST], of_next[:, 1, _NORTH] = -sin, cos
        of_next[:, 2, _HEADING] = 1.0
        of_first[:] = -of_next
        of_first[:, 0, _HEADING], of_first[:, 1, _HEADING] = aside, -ahead
        of_first[:, 0, _SLIP], of_first[:, 2, _BIAS] = moved[:, 0], span_s
        information = _weights(residual**2 / self._odometry.variance, _ODOMETRY_DOF) / self._odometry.variance
        diagonal[:-1] += np.einsum("nki,nk,nkj->nij", of_first, information, of_first)
        diagonal[1:] += np.einsum("nki,nk,nkj->nij", of_next, information, of_next)
        below += np.einsum("nki,nk,nkj->nij", of_next, information, of_first)
        slope[:-1] -= np.einsum("nki,nk,nk->ni", of_first, information, residual)
        slope[1:] -= np.einsum("nki,nk,nk->ni", of_next, information, residual)

    def _add_fixes(self, x: Floats, diagonal: Floats, slope: Floats) -> None:
        """Compare poses with positions."""
        node, arm, place, whole = self._fixes
        cos, sin = np.cos(x[node, _HEADING]), np.sin(x[node, _HEADING])
        arm_e, arm_n = cos * arm[:, 0] - sin * arm[:, 1], sin * arm[:, 0] + cos * arm[:, 1]
        residual = x[node, :2] + np.column_stack((arm_e, arm_n)) + x[node, _SLOW:] - place
        rows = np.zeros((len(node), 2, _STATES))
        rows[:, 0, _EAST] = rows[:, 1, _NORTH] = rows[:, 0, _SLOW] = rows[:, 1, _SLOW + 1] = 1.0
        rows[:, 0, _HEADING], rows[:, 1, _HEADING] = -arm_n, arm_e
        variance = whole * (FIX_DOF - 2.0) / FIX_DOF
        information = (FIX_DOF + 2.0) / (FIX_DOF + (residual**2).sum(axis=1) / variance) / variance
        np.add.at(diagonal, node, np.einsum("nki,n,nkj->nij", rows, information, rows))
        np.add.at(slope, node, -np.einsum("nki,n,nk->ni", rows, information, residual))


def _weights(squares: Floats, dof: float) -> Floats:
    """Return weights of numbers with a Student-t distribution, by their squares in units of the variance."""
    return (dof + 1.0) / (dof + squares)


def _banded(diagonal: Floats, below: Floats, right: Floats) -> Floats:
    """Solve a symmetric system of blocks.

    Args:
        diagonal: (n, k, k) blocks on the diagonal.
        below: (n − 1, k, k) blocks below them.
        right: (n, k) right side.
    """
    n, k = right.shape
    band = np.zeros((2 * k, n, k))
    for j in range(k):
        for i in range(j, k):
            band[i - j, :, j] = diagonal[:, i, j]
        for i in range(k):
            band[k + i - j, :-1, j] = below[:, i, j]
    solution = solveh_banded(band.reshape(2 * k, n * k), right.ravel(), lower=True)
    return cast("Floats", solution.reshape(n, k))
