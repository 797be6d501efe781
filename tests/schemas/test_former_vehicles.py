"""Vehicles as they were written before body, drive and tool were apart: the same robots."""

import json
from pathlib import Path

import pytest

from touchline.schemas.errors import SpecError
from touchline.schemas.setup import Setup
from touchline.schemas.spec import parse, read_text
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.former_vehicles import FORMER_FIELDS

EXAMPLE = Path(__file__).parents[2] / "examples" / "small-robot.json"


def flat(vehicle: Vehicle) -> dict[str, object]:
    """As it was written formerly."""
    dump = vehicle.model_dump(mode="json")
    return {"name": dump["name"]} | {name: dump[part][field] for name, (part, field) in FORMER_FIELDS.items()}


@pytest.mark.parametrize("vehicle", [Vehicle(), parse(Vehicle, read_text(EXAMPLE), EXAMPLE.name)])
def test_a_former_vehicle_is_the_same_robot(vehicle: Vehicle) -> None:
    former = flat(vehicle)
    assert former["kinematics"] == "differential"
    assert parse(Vehicle, json.dumps(former), "former.json") == vehicle
    assert parse(Setup, json.dumps({"vehicle": former}), "setup", recorded=True).vehicle == vehicle


@pytest.mark.parametrize("name", FORMER_FIELDS)
def test_every_former_field_alone_is_taken_to_its_place(name: str) -> None:
    part, field = FORMER_FIELDS[name]
    value = flat(Vehicle())[name]
    assert getattr(getattr(parse(Vehicle, json.dumps({name: value}), "one.json"), part), field) is not None
    with pytest.raises(SpecError, match=f"both.json: {name} .*; give it as {part}.{field}, where body, drive and tool"):
        parse(Vehicle, json.dumps({name: value, "body": {}}), "both.json")
