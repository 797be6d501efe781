"""Blind run: a second filter beside the first, without fixes for some seconds, that shows what an outage would.

It follows the oldest tick of the ring, which no late message changes any more, and is run only while the filter is
inconsistent or has been of late: a job whose files are right costs nothing.
"""

from __future__ import annotations

from typing import Any, Final

from touchline.core.jit import kernel
from touchline.onboard.computer_state import FilterState
from touchline.onboard.estimation.adaptation import FIRST_WANDER, adapt_wander
from touchline.onboard.estimation.tick_estimate import Scratch, TickEstimate
from touchline.onboard.estimation.tick_step import step
from touchline.onboard.filter_model import STATES

FIRST_TICKS: Final = 200
"""Length of the first blind run; each is twice as long as the one before, up to the next."""
LONGEST_TICKS: Final = 1600
"""Length in which errors of heading show, and of which there still are some in a minute."""


@kernel
def run_blind(ring: FilterState, drive: Any, slot: int, scratch: Scratch) -> None:
    """Run the blind filter up to the oldest tick of the ring.

    Args:
        ring: State of the filter; `blind` is updated.
        drive: Figures of the drive.
        slot: Place of the oldest tick in the ring.
        scratch: Overwritten.
    """
    blind, n = ring.blind, ring.counters
    if not (n.inconsistent and ring.figures.adapts) and blind.wander == 0.0:
        blind.ticks, blind.span_ticks = 0, FIRST_TICKS
        return
    if blind.wander == 0.0:
        blind.wander = FIRST_WANDER
    if blind.ticks == 0 or blind.recoveries != n.recoveries:
        blind.ticks, blind.recoveries = 0, n.recoveries
        _set(ring, slot)
    else:
        blind.inputs[1] = ring.inputs[slot]
        step(
            TickEstimate(blind.states[0], blind.covariances[0], blind.inputs[0]),
            TickEstimate(blind.states[1], blind.covariances[1], blind.inputs[1]),
            ring,
            drive,
            False,
            scratch,
        )
        if blind.ticks == blind.span_ticks:
            adapt_wander(blind, ring.states[slot], ring.covariances[slot])
            blind.ticks, blind.span_ticks = 0, min(2 * blind.span_ticks, LONGEST_TICKS)
            return
        for i in range(STATES):
            blind.states[0, i] = blind.states[1, i]
            for k in range(STATES):
                blind.covariances[0, i, k] = blind.covariances[1, i, k]
        blind.inputs[0] = blind.inputs[1]
    blind.ticks += 1


@kernel
def _set(ring: FilterState, slot: int) -> None:
    """Set the blind filter to the oldest tick of the ring."""
    blind = ring.blind
    for i in range(STATES):
        blind.states[0, i] = ring.states[slot, i]
        for k in range(STATES):
            blind.covariances[0, i, k] = ring.covariances[slot, i, k]
    blind.inputs[0] = ring.inputs[slot]
