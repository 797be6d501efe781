"""A warm start compiles nothing and says nothing."""

import pytest

from touchline.onboard.trajectory.path_projection import piece_at
from touchline.schemas.setup import Setup
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.warm_up import warm_up

SLOW = Vehicle(drive={"wheel_radius_m": 0.02, "transit_speed_mps": 0.4}, tool={"paint_speed_mps": 0.3})
WEAK = Vehicle(drive={"motor": {"max_current_a": 0.01}})


def test_warm_up_is_silent_once_all_is_cached():
    warm_up()
    said = []
    warm_up(said.append)
    assert said == []
    # Python calls this kernel only when a trajectory takes over under way; the control loop would not turn meanwhile.
    assert piece_at.prepared


@pytest.mark.parametrize("vehicle", [WEAK, pytest.param(SLOW, marks=pytest.mark.full)], ids=["weak", "slow"])
def test_any_vehicle_warms_up(vehicle):
    said = []
    warm_up(said.append, Setup(vehicle=vehicle))
    assert [line for line in said if "compil" not in line] == []
