"""Delayed-measurement fusion: late samples and fixes are fused at the time at which they were measured.

A fix is valid some 110 ms before it arrives. The ring holds the posterior of each of the last `RING` ticks and what
was measured in it; whatever comes late is entered in its own tick, and the ticks since are run again. Fixes and samples
that arrive out of order therefore end in the same estimate as in order. What is learned beside the states comes from
the oldest tick of the ring, which nothing changes any more, and each tick keeps what it was run with.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.services.core.jit import kernel
from touchline.services.onboard.computer_state import FilterState
from touchline.services.onboard.drives import onboard_drive
from touchline.services.onboard.estimation.calibration import LEARN_TICKS, learn, store_learned
from touchline.services.onboard.estimation.measurements import (
    Scratch,
    TickEstimate,
    add_shaking_noise,
    fix_rows,
    measure,
    use_fix,
)
from touchline.services.onboard.estimation.prediction import predict
from touchline.services.onboard.estimation.standing import settle_dispute
from touchline.services.onboard.estimation.tail import CONTRADICTED, bounded, doubt, likelihood
from touchline.services.onboard.estimation.updates import nis_of_two
from touchline.services.onboard.filter_model import (
    ACCEL_BIAS,
    C_MAST,
    EAST,
    FIX_DOUBT,
    FIX_USED,
    FIX_VARIANCE,
    IN_ACCEL,
    IN_REFUSED,
    IN_RISE_EAST,
    IN_RISE_NORTH,
    INNOVATION_EAST,
    INNOVATION_NORTH,
    N_FIX_DUPLICATE,
    N_FIX_LATE,
    N_FIX_OUT_OF_ORDER,
    N_FIX_OUTLYING_RUN,
    N_FIX_REJECTED,
    N_FIXES,
    NIS_FIX_LAST,
    NIS_FIX_RECENT,
    NIS_FIX_SUM,
    NORTH,
    RING,
    SPEED,
    STATES,
)

Floats = NDArray[np.float64]

_RECENT = 0.1  # weight of the newest fix in the running NIS
_NO_IMU_SPEED_VAR = 1e-4  # (1 m/s² · a tick)²


@kernel
def _step(ring: FilterState, drive: Any, slot: int, live: bool, scratch: Scratch) -> None:
    """Predict and update: the posterior of `slot` from that of the slot before."""
    xs, Ps, inputs = ring.states, ring.covariances, ring.inputs
    c, n = ring.figures, ring.counters
    before = (slot - 1) % RING
    x, P = xs[slot], Ps[slot]
    for i in range(STATES):
        x[i] = xs[before, i]
        for k in range(STATES):
            P[i, k] = Ps[before, i, k]
    # The fixes have put the position where it is: it moves with what is learned of the mast's lean.
    x[EAST] += c[C_MAST] * (inputs[slot, IN_RISE_EAST] - inputs[before, IN_RISE_EAST])
    x[NORTH] += c[C_MAST] * (inputs[slot, IN_RISE_NORTH] - inputs[before, IN_RISE_NORTH])
    onboard_drive.smooth(drive, inputs[before], inputs[slot])
    disputed = settle_dispute(x, P, inputs[before], inputs[slot], c)
    accel = inputs[slot, IN_ACCEL]
    if math.isnan(accel):
        accel = x[ACCEL_BIAS]
        P[SPEED, SPEED] += _NO_IMU_SPEED_VAR
    elif disputed:
        accel = x[ACCEL_BIAS]
    predict(x, P, accel, inputs[slot], c)
    # Readings that are rejected again and again are counted: the drive may have an explanation.
    inputs[slot, IN_REFUSED] = inputs[before, IN_REFUSED] if inputs[before, IN_REFUSED] > 0.0 else 0.0
    onboard_drive.strain(drive, P, inputs[before], inputs[slot])
    add_shaking_noise(P, inputs[before], inputs[slot])
    measure(TickEstimate(x, P, inputs[slot]), c, drive, n, live, scratch)


@kernel
def _rerun(ring: FilterState, drive: Any, first: int, last: int, live: int, scratch: Scratch) -> None:
    """Run the ticks `first` … `last` again; statistics count in tick `live` only."""
    xs, Ps, inputs = ring.states, ring.covariances, ring.inputs
    fixes, c = ring.fixes, ring.figures
    for tick in range(first, last + 1):
        slot = tick % RING
        _step(ring, drive, slot, tick == live, scratch)
        if fixes[slot, FIX_USED] > 0.0:
            use_fix(TickEstimate(xs[slot], Ps[slot], inputs[slot]), fixes[slot], c, scratch)


@kernel
def advance(ring: FilterState, drive: Any, tick: int, oldest: int, live: int) -> None:
    """Advance the filter by one tick, and first run it again from the `oldest` tick that has a new measurement.

    Args:
        ring: Updated; the inputs of the tick are filled in already.
        drive: Figures of the drive.
        tick: This tick.
        oldest: At most `tick`, later than the tick in which the filter was started.
        live: The tick whose measurements are new and count in the statistics.
    """
    xs, inputs, fixes = ring.states, ring.inputs, ring.fixes
    c, slow = ring.figures, ring.slow
    h = np.zeros((2, STATES))
    g = np.zeros(STATES)
    fixes[tick % RING, FIX_USED] = 0.0
    settled = (tick + 1) % RING
    if settled % LEARN_TICKS == 0 or fixes[settled, FIX_USED] > 0.0:
        learn(settled, xs[settled], inputs[settled], fixes[settled], c, slow)
    store_learned(slow, inputs[tick % RING])
    _rerun(ring, drive, oldest, tick, live, (h, g))


@kernel
def take_fix(ring: FilterState, drive: Any, tick: int, first_tick: int, fix_tick: int) -> bool:
    """Use a fix, the last row of `ring.fixes`, in the tick in which it is valid, and run the ticks since again.

    Fixes from before the filter was started are used in the tick in which it was.

    Args:
        ring: Updated from the tick of the fix on.
        drive: Figures of the drive.
        tick: This tick, in which the fix has arrived.
        first_tick: In which the filter was started.
        fix_tick: The tick at whose time, or less than a tick after it, the fix was measured.

    Returns:
        Whether it is used.
    """
    xs, Ps, inputs = ring.states, ring.covariances, ring.inputs
    fixes, c, n = ring.fixes, ring.figures, ring.counters
    h = np.zeros((2, STATES))
    g = np.zeros(STATES)
    at = max(fix_tick, first_tick)
    if at > tick or tick - at > RING - 2:
        n[N_FIX_LATE] += 1.0
        return False
    where = at % RING
    fix = fixes[RING]
    if fixes[where, FIX_USED] > 0.0 and at == fix_tick:
        n[N_FIX_DUPLICATE] += 1.0
        return False
    valid = TickEstimate(xs[where], Ps[where], inputs[where])
    y = fix_rows(valid, fix, c, h)
    nis = nis_of_two(valid.P, h, y, fix[FIX_VARIANCE])
    weighed = bounded(nis)
    n[INNOVATION_EAST], n[INNOVATION_NORTH], n[NIS_FIX_LAST] = y[0], y[1], weighed
    n[FIX_DOUBT] = doubt(n[FIX_DOUBT], likelihood(nis))
    n[N_FIX_OUTLYING_RUN] = n[N_FIX_OUTLYING_RUN] + 1.0 if n[FIX_DOUBT] > 0.0 else 0.0
    if n[FIX_DOUBT] >= CONTRADICTED:
        n[N_FIX_REJECTED] += 1.0
        return False
    n[N_FIXES] += 1.0
    n[NIS_FIX_SUM] += weighed
    n[NIS_FIX_RECENT] += _RECENT * (weighed - n[NIS_FIX_RECENT])
    for later in range(at + 1, tick + 1):
        if fixes[later % RING, FIX_USED] > 0.0:
            n[N_FIX_OUT_OF_ORDER] += 1.0
            break
    for k in range(fixes.shape[1]):
        fixes[where, k] = fix[k]
    fixes[where, FIX_USED] = 1.0
    use_fix(valid, fixes[where], c, (h, g))
    _rerun(ring, drive, at + 1, tick, -1, (h, g))
    return True
