"""Tank and battery: enough for a job, or not."""

import math

import pytest

from touchline.schemas.messages import PlanReport
from touchline.schemas.supplies import LOW_BATTERY, LOW_TANK_L, full, supplies
from touchline.schemas.vehicles import Vehicle

VEHICLE = Vehicle(tool={"tank_l": 20.0}, body={"battery_wh": 600.0})


@pytest.mark.parametrize(
    ("needed", "there", "refills"),
    [
        (14.0, 14.9, 0),
        (14.9 - LOW_TANK_L, 14.9, 0),
        (14.9, 14.9, 1),
        (30.0, 14.9, 1),
        (40.0, 14.9, 2),
        (30.0, 0.0, 2),
    ],
)
def test_a_tank_has_to_be_refilled_as_often_as_it_runs_out(needed: float, there: float, refills: int) -> None:
    found = supplies(PlanReport(paint_l=needed), VEHICLE, there, 1.0)
    assert found.paint.refills == refills
    assert found.last == (refills == 0)


def test_shortages_tell_what_is_needed_what_is_there_and_what_to_do() -> None:
    found = supplies(PlanReport(paint_l=30.1, battery_wh=155.0), VEHICLE, 14.9, 0.3)
    assert found.shortages == (
        "needs 30.1 L of paint, the tank has 14.9 L: refill it once",
        "needs 155 Wh, the battery has 180 Wh, of which it keeps 48.0 Wh: change it once",
    )
    assert found.battery.reserve == LOW_BATTERY * 600.0


def test_what_nobody_has_told_is_no_shortage() -> None:
    assert supplies(None, VEHICLE, 0.0, 0.0).last
    assert supplies(PlanReport(paint_l=30.0, battery_wh=1e4), VEHICLE).last
    assert supplies(PlanReport(paint_l=math.nan), VEHICLE, math.inf, math.nan).last
    assert supplies(PlanReport(), VEHICLE, 0.0, 0.0).last


def test_a_full_vehicle_is_full() -> None:
    assert full(PlanReport(paint_l=19.9, battery_wh=500.0), VEHICLE).last
    assert not full(PlanReport(paint_l=20.1, battery_wh=500.0), VEHICLE).paint.lasts
    assert not full(PlanReport(paint_l=19.9, battery_wh=599.0), VEHICLE).battery.lasts
