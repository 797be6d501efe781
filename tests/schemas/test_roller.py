"""The clay roller is found by its name; what cannot be is refused."""

import json
import re

import pytest

from touchline.schemas.catalogue import load_vehicle
from touchline.schemas.errors import SpecError
from touchline.schemas.fleet import Fleet
from touchline.schemas.scenario import DriveNoise, Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.spec import parse
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.shipped import CLAY_ROLLER, SHIPPED


def test_it_is_found_by_its_name_and_written_as_a_file_that_can_be_given(tmp_path):
    assert load_vehicle("clay-roller") is CLAY_ROLLER
    assert load_vehicle("turf-tank-two") == Vehicle()
    assert parse(Vehicle, CLAY_ROLLER.model_dump_json(), "printed") == CLAY_ROLLER
    path = tmp_path / "fleet.json"
    path.write_text('{"robots": [{"namespace": "r", "vehicle": "clay-roller"}]}')
    assert Fleet.read(path).robots[0].vehicle == CLAY_ROLLER
    assert all(shipped.vehicle.name == name for name, shipped in SHIPPED.items())
    with pytest.raises(
        SpecError, match="give a path or one of: turf-tank-two, clay-roller, turtlebot3-waffle-pi, turtlebot2"
    ):
        load_vehicle("steam-roller")


@pytest.mark.parametrize(
    ("drive", "says"),
    [
        ({"max_steering_rad": 0}, "drive.max_steering_rad is 0; give at least 0.01 rad"),
        ({"can_spin": True}, "drive.can_spin is True; give false: it has no way to turn on the spot"),
        ({"top_speed_mps": 1.5}, "drive.top_speed_mps is 1.5; give at most 1.1 m/s: the drum does no more"),
        ({"transit_speed_mps": 1.05}, "drive.transit_speed_mps is 1.05; give at most 1 m/s: the drive does no more"),
        ({"wheel_radius_m": 0.1}, "drive.wheel_radius_m is not a known field"),
    ],
)
def test_what_cannot_be_is_refused(drive, says):
    with pytest.raises(SpecError, match=re.escape(says)):
        parse(Vehicle, json.dumps({"drive": {"kind": "rear-steered", **drive}, "tool": {"kind": "roller"}}), "own.json")


def test_a_roller_works_both_ways_at_any_speed_and_a_sprayer_does_not():
    roller, sprayer = CLAY_ROLLER.tool, Vehicle().tool
    assert (roller.steady_speed, roller.covers, roller.paints) == (False, True, False)
    assert (sprayer.steady_speed, sprayer.covers, sprayer.paints) == (True, False, True)
    assert roller.width_m == 2.2


def test_the_offset_is_written_only_where_it_is_another():
    """So that the hashes of scenarios without a steered robot stay what they were."""
    assert "steering_offset_rad" not in Setup().model_dump_json()
    other = Scenario(drive=DriveNoise(steering_offset_rad=0.035))
    assert parse(Scenario, other.model_dump_json(), "written") == other
    assert Scenario(noise="none").effective().drive.steering_offset_rad == 0.0
