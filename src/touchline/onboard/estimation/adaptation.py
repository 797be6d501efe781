"""Adaptation: the claimed σ grows, within bounds, until it is true again.

Four rules, none of which acts in a job whose files are right:

- **Wander.** A filter that wanders more than its noise figures say follows the fixes all the same, but claims too much
  once it has none. If innovations are correlated, so that the figures are wrong (`consistency_monitor`), a second
  filter is run without fixes for some seconds at a time (`blind_run`). Its error over its σ is what an outage would
  have shown, and scales unmodelled motion: a random walk sideways and along, and one of the heading (covariance
  matching: R. K. Mehra, "Approaches to adaptive filtering", IEEE Trans. Automatic Control 17(5), 1972).
- **Stray.** If a robot that is known to wander has its fixes rejected though the receiver has not jumped, the estimate
  has strayed. Its σ grows by that distance at once, and the fix is used (strong tracking filter: D. H. Zhou and P. M.
  Frank, Int. J. Control 65(2), 1996). The same holds once it has been driven on for some metres, whatever the fixes
  did: nobody waits for an operator then.
- **Acceleration.** Without an accelerometer wheels alone tell the speed. Where their readings change faster than the
  process noise says, the noise grows with them.
- **Doubtful wheels.** Where they change faster than robots do, the speed is as uncertain as the reading is far off, and
  the reading as well.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import borrowing, kernel
from touchline.onboard.computer_state import FilterState
from touchline.onboard.estimation.consistency_monitor import MOVING_MPS
from touchline.onboard.filter_model import (
    EAST,
    HEADING,
    NORTH,
    SPEED,
    BlindRun,
    FilterCounters,
    FilterFigures,
    FixInTick,
)
from touchline.onboard.interface import TICK_S

Floats = NDArray[np.float64]

WALK_M2PM: Final = 0.01**2
"""Variance per metre of a random walk of the position, along each axis [m²/m], with a wander of 1."""
TURN_RAD2PM: Final = 0.0005**2
"""Variance per metre of a random walk of the heading [rad²/m], with a wander of 1."""
FIRST_WANDER: Final = 9.0
"""Wander to begin with: a mower on a meadow is 3 cm off after a metre (docs/measurements/logs.md)."""
MOST_WANDER: Final = 100.0
"""Largest wander: 10 cm and 0.3° over a metre, 1 m and 3° over 100 m."""
_FASTEST = 3.0  # most by which σ grows after one blind run
_DECAY = 0.998  # of the variance, per second of one whose error is within its σ
_CHANCE_SHARE = 0.01  # of the expected square: of errors, one in a hundred is smaller by chance
_RELIEF = 0.5  # of the variance that is left after an error that is smaller
_LEAST = 0.01
SEEN_SHARE: Final = 0.5
"""Share of the distance to the fixes that a receiver has to have moved from one to the next to have jumped."""
_DRIVEN_ON_M = 2.0
_STRAY_HEADING_VAR = math.radians(0.3) ** 2
_MOST_ACCEL_MPS = 0.1  # per tick: 10 m/s², more than tyres hold


@kernel
def add_wander(x: Floats, P: Floats, wander: float) -> None:
    """Add unmodelled motion to a predicted covariance.

    Args:
        x: (STATES,) predicted state.
        P: (STATES, STATES) its covariance, updated.
        wander: Multiple of the walks above.
    """
    driven_m = abs(x[SPEED]) * TICK_S
    P[EAST, EAST] += wander * WALK_M2PM * driven_m
    P[NORTH, NORTH] += wander * WALK_M2PM * driven_m
    P[HEADING, HEADING] += wander * TURN_RAD2PM * driven_m


@kernel
def adapt_wander(blind: BlindRun, x: Floats, known: Floats) -> None:
    """Scale the wander by the error of a blind run: faster up than down, since most errors are small by chance.

    An error that is far smaller than its σ is no chance, and a wander that one fault has taught goes within minutes.
    The less a run has added to the covariance, as at rest, the less it tells.

    Args:
        blind: The blind run, at its end; its wander is updated.
        x: (STATES,) state of the filter with fixes in the same tick.
        known: (STATES, STATES) its covariance.
    """
    at, P = blind.states[1], blind.covariances[1]
    east, north = x[EAST] - at[EAST], x[NORTH] - at[NORTH]
    a, b, d = P[EAST, EAST], P[EAST, NORTH], P[NORTH, NORTH]
    share = 0.5 * (d * east * east - 2.0 * b * east * north + a * north * north) / (a * d - b * b)
    news = max(1.0 - (known[EAST, EAST] + known[NORTH, NORTH]) / (a + d), 0.0)
    factor = min(share, _FASTEST * _FASTEST) if share > 1.0 else _DECAY ** (blind.ticks * TICK_S)
    if share < _CHANCE_SHARE:
        factor = _RELIEF**news
    wander = (1.0 + blind.wander) * factor - 1.0
    blind.wander = min(wander, MOST_WANDER) if wander > _LEAST else 0.0


@kernel
def wander_now(ring: FilterState) -> float:
    """Return the wander with which to run a tick: the largest one while fixes contradict a robot that does wander.

    Args:
        ring: State of the filter; the largest wander so far is updated.
    """
    blind = ring.blind
    blind.wander_most = max(blind.wander_most, blind.wander)
    if blind.wander > 0.0 and ring.counters.fix_doubt >= ring.figures.fix_doubt_most:
        return MOST_WANDER
    return blind.wander


@kernel
def note_contradiction(n: FilterCounters, c: FilterFigures, x: Floats) -> None:
    """Note how far the robot has been driven while its fixes are rejected.

    Args:
        n: Counters, updated.
        c: Figures of the filter.
        x: (STATES,) state of the present tick.
    """
    n.contradicted_m = n.contradicted_m + abs(x[SPEED]) * TICK_S if n.fix_doubt >= c.fix_doubt_most else 0.0


@kernel
def has_jumped(n: FilterCounters, share: float) -> bool:
    """Return whether the receiver has moved to the last fix of a run of outlying ones, rather than the estimate.

    Args:
        n: Counters.
        share: Share of the distance to that fix that it has to have moved in one step.
    """
    off_m = math.hypot(n.innovation_east_m, n.innovation_north_m)
    return n.outlying_step_m >= share * off_m


@kernel
def strays(ring: FilterState, speed_mps: float) -> bool:
    """Return whether the estimate has strayed from the rejected fix that has arrived; then it is to be used after all.

    Args:
        ring: State of the filter; counters and fix are updated if it has.
        speed_mps: Speed when the fix was measured.
    """
    n, fix = ring.counters, ring.arrived
    if ring.blind.wander == 0.0 or abs(speed_mps) < MOVING_MPS:
        return False
    if has_jumped(n, SEEN_SHARE) and n.contradicted_m < _DRIVEN_ON_M:
        return False
    off_m = math.hypot(n.innovation_east_m, n.innovation_north_m)
    fix.strayed_m = off_m
    n.strays += 1
    n.stray_most_m = max(n.stray_most_m, off_m)
    n.fix_doubt, n.fixes_outlying_run, n.outlying_step_m = 0.0, 0, 0.0
    n.fixes_rejected -= 1
    n.fixes += 1
    n.fix_nis_sum += n.fix_nis_last
    return True


@kernel
def add_stray(P: Floats, fix: FixInTick) -> None:
    """Add to the covariance by how far the estimate has strayed from a fix.

    Args:
        P: (STATES, STATES) covariance before the fix is used, updated.
        fix: The fix.
    """
    variance = fix.strayed_m * fix.strayed_m
    P[EAST, EAST] += variance
    P[NORTH, NORTH] += variance
    P[HEADING, HEADING] += _STRAY_HEADING_VAR


@borrowing
def doubted_variance(P: Floats, y: tuple[float, float], r: float) -> float:
    """Return the variance of wheels' readings where nothing else tells the speed, and let that of the speed grow.

    Args:
        P: (STATES, STATES) covariance, updated.
        y: Innovations of both readings.
        r: Variance by the data sheet.
    """
    mean = 0.5 * (y[0] + y[1])
    if mean * mean <= P[SPEED, SPEED] + r:
        return r
    P[SPEED, SPEED] += mean * mean
    if abs(mean) <= _MOST_ACCEL_MPS:
        return r
    return r + mean * mean
