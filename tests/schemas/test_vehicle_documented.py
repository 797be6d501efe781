"""docs/reference/vehicles.md has every field of a vehicle with default, unit and range; the example is one."""

import json
import re
from pathlib import Path

import annotated_types
import pytest

from touchline.schemas.remedies import unit_of
from touchline.schemas.spec import parse, read_text
from touchline.schemas.vehicles import Motor, Vehicle

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "reference" / "vehicles.md").read_text(encoding="utf-8")
TABLE = TEXT[TEXT.index("## Your own robot") :]
ROWS = {cells[1].strip("` "): cells for cells in (line.split("|") for line in TABLE.splitlines()) if len(cells) == 7}
PARTS = {"body": Vehicle().body, "drive": Vehicle().drive, "tool": Vehicle().tool}
FIELDS = {name: Vehicle.model_fields[name] for name in ("name", "positioning")}
FIELDS |= {f"{part}.{name}": field for part, spec in PARTS.items() for name, field in type(spec).model_fields.items()}
del FIELDS["drive.motor"]
FIELDS |= {f"drive.motor.{name}": field for name, field in Motor.model_fields.items()}
SIGNS = {
    annotated_types.Ge: ("≥", "ge"),
    annotated_types.Gt: (">", "gt"),
    annotated_types.Le: ("≤", "le"),
    annotated_types.Lt: ("<", "lt"),
}


def test_the_table_has_the_fields_and_no_others():
    assert set(ROWS) - {"field", "---"} == set(FIELDS)


@pytest.mark.parametrize("name", sorted(set(FIELDS) - {"body.footprint_m"}))
def test_the_default_is_the_one_told(name):
    assert json.loads(ROWS[name][2]) == json.loads(json.dumps(FIELDS[name].default))


@pytest.mark.parametrize("name", FIELDS)
def test_the_unit_is_the_one_that_a_refusal_tells(name):
    unit = unit_of((name.rpartition(".")[2],))
    assert ROWS[name][3].strip() == (unit or ("ticks" if "encoder_ticks" in name else ""))


@pytest.mark.parametrize("name", sorted(set(FIELDS) - {"body.footprint_m", "drive.casters_m"}))
def test_the_range_is_the_one_that_is_held(name):
    held = {
        (SIGNS[type(bound)][0], float(getattr(bound, SIGNS[type(bound)][1])))
        for bound in FIELDS[name].metadata
        if type(bound) in SIGNS
    }
    told = {(sign, float(number)) for sign, number in re.findall(r"([<>≤≥]) (-?[\d.]+)", ROWS[name][4])}
    assert told == held


@pytest.mark.parametrize("name", sorted(name for name in FIELDS if FIELDS[name].annotation in (int, float)))
def test_every_number_is_bounded(name):
    kinds = {type(bound) for bound in FIELDS[name].metadata}
    assert kinds & {annotated_types.Ge, annotated_types.Gt}
    assert kinds & {annotated_types.Le, annotated_types.Lt}


def test_the_example_is_another_robot_that_says_so():
    example = parse(Vehicle, read_text(ROOT / "examples" / "small-robot.json"), "small-robot.json")
    shipped = Vehicle()
    assert example.name == "small-robot"
    assert example.drive.track_width_m < shipped.drive.track_width_m
    assert example.drive.max_speed_mps < shipped.drive.max_speed_mps
