"""Turns on offer suit every speed that a robot may be planned with, also those of robots slower than any turn."""

import pytest

from touchline.schemas.messages import PlanOptions
from touchline.schemas.plugins import METHODS
from touchline.schemas.vehicles.shipped import SHIPPED
from touchline.services.planner.limits import Limits
from touchline.services.planner.marking import transitions_of


@pytest.mark.parametrize("method", METHODS.names())
@pytest.mark.parametrize("name", SHIPPED)
def test_every_turn_has_a_curvature_and_a_sharpness(name: str, method: str) -> None:
    vehicle = SHIPPED[name].vehicle
    top = vehicle.drive.transit_speed_mps
    for paint_speed_mps in (0.0, 0.05, 0.5 * top, top):
        options = PlanOptions(method=method, paint_speed_mps=paint_speed_mps)
        for turns in transitions_of(vehicle, options, Limits.of(vehicle, options)).turns:
            assert turns.curvature_1pm > 0.0 and turns.sharpness_1pm2 > 0.0
