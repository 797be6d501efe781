"""Delayed-measurement fusion: late samples and fixes are fused at the time at which they were measured.

A fix is valid some 110 ms before it arrives. The ring holds posterior and measurements of each of the last `RING`
ticks. A late measurement is entered in its own tick, and the ticks since are run again, so that fixes and samples that
arrive out of order end in the same estimate as in order. Calibration uses the oldest tick of the ring, which nothing
changes any more, and each tick keeps the learned figures that it was run with.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.core.arrays import copy
from touchline.core.jit import kernel
from touchline.onboard.computer_state import Computer, FilterState
from touchline.onboard.estimation.adaptation import note_contradiction, strays, wander_now
from touchline.onboard.estimation.aiding.gnss_aiding import add_sway, set_slow_error_aside
from touchline.onboard.estimation.blind_run import run_blind
from touchline.onboard.estimation.calibration import LEARN_TICKS, learn, store_learned
from touchline.onboard.estimation.measurements import accept_fix, use_fix
from touchline.onboard.estimation.tick_estimate import Scratch, TickEstimate
from touchline.onboard.estimation.tick_step import step
from touchline.onboard.estimation.updates import apply_rows, passes_gate
from touchline.onboard.filter_model import EAST, MOST_UPDATES, NORTH, RING, SPEED, STATES, UPDATE_VARIANCE

Floats = NDArray[np.float64]

_STOOD_MPS = 0.05


@kernel
def _rerun(ring: FilterState, drive: Any, first: int, last: int, live: int, scratch: Scratch) -> None:
    """Run the ticks `first` … `last` again; statistics count in tick `live` only."""
    xs, Ps, inputs = ring.states, ring.covariances, ring.inputs
    fixes, c = ring.fixes, ring.figures
    for tick in range(first, last + 1):
        slot = tick % RING
        before = (slot - 1) % RING
        step(
            TickEstimate(xs[before], Ps[before], inputs[before]),
            TickEstimate(xs[slot], Ps[slot], inputs[slot]),
            ring,
            drive,
            tick == live,
            scratch,
        )
        if fixes[slot].used:
            use_fix(TickEstimate(xs[slot], Ps[slot], inputs[slot]), fixes[slot], c, scratch)
        if ring.update_counts[slot] > 0:
            set_slow_error_aside(Ps[slot], c.slow_var)
            apply_rows(xs[slot], Ps[slot], ring.update_rows[slot], ring.update_counts[slot], scratch[1])
            set_slow_error_aside(Ps[slot], -c.slow_var)


@kernel
def advance(ring: FilterState, drive: Any, tick: int, oldest: int, live: int) -> None:
    """Advance the filter by one tick, and first run it again from the `oldest` tick that has a new measurement.

    Args:
        ring: State of the filter, updated; the inputs of the tick are filled in already.
        drive: Figures of the drive.
        tick: This tick.
        oldest: Oldest tick to be run: at most `tick`, later than the tick in which the filter was started.
        live: Tick whose measurements are new and count in the statistics.
    """
    xs, inputs, fixes = ring.states, ring.inputs, ring.fixes
    c, learned = ring.figures, ring.learned
    h = np.zeros((2, STATES))
    g = np.zeros(STATES)
    other = np.zeros((2, 1 + STATES, STATES))
    fixes[tick % RING].used = False
    ring.update_counts[tick % RING] = 0
    settled = (tick + 1) % RING
    if settled % LEARN_TICKS == 0 or fixes[settled].used:
        learn(settled, xs[settled], inputs[settled], fixes[settled], c, learned)
    run_blind(ring, drive, settled, (h, g, other))
    store_learned(learned, inputs[tick % RING])
    inputs[tick % RING].wander = wander_now(ring)
    _rerun(ring, drive, oldest, tick, live, (h, g, other))
    note_contradiction(ring.counters, c, xs[tick % RING])


@kernel
def take_fix(ring: FilterState, drive: Any, tick: int, first_tick: int, fix_tick: int) -> bool:
    """Use the fix that has arrived, in the tick in which it is valid, and run the ticks since again.

    Fixes from before the filter was started, or its position accepted, are used in that tick if the robot stood then.

    Args:
        ring: State of the filter with the fix in `arrived`, updated from the tick of the fix on.
        drive: Figures of the drive.
        tick: This tick, in which the fix has arrived.
        first_tick: Tick in which the filter was started.
        fix_tick: Tick at whose time, or less than a tick after it, the fix was measured.

    Returns:
        Whether it is used.
    """
    xs, Ps, inputs = ring.states, ring.covariances, ring.inputs
    fixes, c, n = ring.fixes, ring.figures, ring.counters
    h = np.zeros((2, STATES))
    g = np.zeros(STATES)
    other = np.zeros((2, 1 + STATES, STATES))
    at = max(fix_tick, first_tick)
    elsewhere = fix_tick < first_tick and abs(xs[first_tick % RING, SPEED]) > _STOOD_MPS
    if at > tick or tick - at > RING - 2 or elsewhere:
        n.fixes_late += 1
        return False
    where, fix = at % RING, ring.arrived
    if fixes[where].used and at == fix_tick:
        n.fixes_duplicate += 1
        return False
    valid = TickEstimate(xs[where], Ps[where], inputs[where])
    add_sway(fix, inputs[where], c)
    if not accept_fix(valid, fix, c, n, (h, g, other)) and not strays(ring, valid.x[SPEED]):
        return False
    for later in range(at + 1, tick + 1):
        if fixes[later % RING].used:
            n.fixes_out_of_order += 1
            break
    fixes[where] = fix
    fixes[where].used = True
    use_fix(valid, fixes[where], c, (h, g, other))
    _rerun(ring, drive, at + 1, tick, -1, (h, g, other))
    return True


@kernel
def take_row(computer: Computer, drive: Any, at: int, row: Floats) -> bool:
    """Use a scalar measurement of an auxiliary sensor in the tick in which it is valid, and run the ticks since again.

    Args:
        computer: (1,) state, whose filter is updated from that tick on.
        drive: Figures of the drive.
        at: Tick in which it is valid: one of the last RING − 2, and not before the filter was started.
        row: (UPDATE_COLUMNS,) Jacobian, value and variance.

    Returns:
        Whether it is used: it is if it lies within its gate, and there is room.
    """
    ring, tick, slot = computer[0].filter, computer[0].times.tick, at % RING
    x, P, count, c = ring.states[slot], ring.covariances[slot], ring.update_counts[slot], ring.figures
    if count >= MOST_UPDATES or not passes_gate(x, P, row):
        return False
    copy(row, ring.update_rows[slot, count])
    ring.update_rows[slot, count, UPDATE_VARIANCE] += c.slow_var * (row[EAST] ** 2 + row[NORTH] ** 2)
    ring.update_counts[slot] = count + 1
    h = np.zeros((2, STATES))
    g = np.zeros(STATES)
    other = np.zeros((2, 1 + STATES, STATES))
    set_slow_error_aside(P, c.slow_var)
    apply_rows(x, P, ring.update_rows[slot, count:], 1, g)
    set_slow_error_aside(P, -c.slow_var)
    _rerun(ring, drive, at + 1, tick, -1, (h, g, other))
    return True
