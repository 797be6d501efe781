"""The valve is switched within the tick, not at its ends."""

from __future__ import annotations

import pytest

from tests.onboard.rig import chain, start, trajectory
from touchline.schemas.messages import TraversalStatus
from touchline.schemas.vehicles import Vehicle

VEHICLE = Vehicle()


@pytest.mark.parametrize("start_m", [5.0, 5.0025, 5.005, 5.0075])
def test_paint_begins_and_ends_within_two_millimetres_of_where_it_is_told(start_m: float) -> None:
    """At 1 m/s a tick is a centimetre; the valve's delays come on top."""
    run = start(trajectory(chain((0.0, 10.0)), sprays=((start_m, 13.0 - start_m),)))
    run.until(TraversalStatus.DONE)
    ((begins, ends),) = run.painted
    assert begins == pytest.approx(start_m + VEHICLE.tool.valve_on_delay_s, abs=2e-3)
    assert ends == pytest.approx(13.0 - start_m + VEHICLE.tool.valve_off_delay_s, abs=2e-3)
