"""The speeds that a plan is made with, against those that were asked for."""

import pytest

from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.limits import Limits


def speeds(**asked: float) -> tuple[float, float]:
    limits = Limits.of(Vehicle(), PlanOptions(**asked))
    return limits.paint_speed_mps, limits.transit_speed_mps


def test_who_asks_for_fast_paint_gets_it() -> None:
    assert speeds() == (1.0, 1.4)
    assert speeds(paint_speed_mps=1.6) == (1.6, 1.6)
    assert speeds(paint_speed_mps=1.6, transit_speed_mps=1.8) == (1.6, 1.8)
    assert Limits.of(Vehicle(), PlanOptions(paint_speed_mps=1.6)).steady_speed_mps(0.0) == pytest.approx(1.6)


def test_who_asks_for_slow_transit_alone_gets_no_faster_paint() -> None:
    assert speeds(transit_speed_mps=0.7) == (0.7, 0.7)


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        ({"paint_speed_mps": 1.6, "transit_speed_mps": 1.5}, "paint_speed_mps = 1.6 above transit_speed_mps = 1.5"),
        ({"paint_speed_mps": 2.1}, "paint_speed_mps = 2.1; give 0.05 to 2 m/s"),
    ],
)
def test_speeds_that_contradict_or_are_too_high_are_refused(asked: dict[str, float], says: str) -> None:
    with pytest.raises(PlanningError, match=says):
        speeds(**asked)
