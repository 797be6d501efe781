"""A file's problems are all told at once, with the name that was probably meant."""

import json

import pytest

from touchline.schemas.catalogue import parse_template
from touchline.schemas.errors import MOST_OTHERS, SpecError
from touchline.schemas.near_names import did_you_mean
from touchline.schemas.scenario import Scenario
from touchline.schemas.spec import parse
from touchline.schemas.vehicles import Vehicle


def problems(kind, data):
    with pytest.raises(SpecError) as refused:
        parse(kind, json.dumps(data), "a.json")
    return str(refused.value).splitlines()


def test_every_problem_is_a_line_with_field_and_remedy():
    line = {"id": "bar", "line": {"start": [0, 0], "ende": [8, 0]}}
    arc = {"id": "bow", "arc": {"start": [8, 0], "center": [8, -3], "sweep_angle": -90}}
    with pytest.raises(SpecError) as refused:
        parse_template(json.dumps({"name": "tee", "line_widht_m": 0.1, "segments": [line, arc]}), "tee.json")
    assert str(refused.value).splitlines() == [
        "tee.json: segments[0].line.end is missing; add it",
        "tee.json: segments[0].line.ende is not a known field; did you mean 'end'?",
        (
            "tee.json: segments[1].arc.sweep_angle is -90; "
            "give at least -6.283185308 rad (in radians, not degrees: -1.5708)"
        ),
        "tee.json: line_widht_m is not a known field; did you mean 'line_width_m'?",
    ]
    assert refused.value.field == "segments[0].line.end"


def test_the_fields_of_a_union_are_known_too():
    (wheel,) = problems(Vehicle, {"drive": {"kind": "differential", "wheel_radus_m": 0.1}})
    assert wheel == "a.json: drive.wheel_radus_m is not a known field; did you mean 'wheel_radius_m'?"
    (kind,) = problems(Scenario, {"faults": [{"kind": "gnss-outge"}]})
    assert kind.endswith("did you mean 'gnss-outage'?")


def test_a_name_like_no_other_gets_no_suggestion():
    (line,) = problems(Scenario, {"zzz": 1})
    assert line == "a.json: zzz is not a known field; remove it or mend its name"
    assert did_you_mean("zzz", ["seed", "gnss"]) == ""


def test_a_file_of_hundreds_of_problems_shows_the_first_ones():
    lines = problems(Scenario, {f"unknown_{number}": 1 for number in range(300)})
    assert len(lines) == MOST_OTHERS + 2
    assert lines[-1] == f"a.json: {300 - MOST_OTHERS - 1} more problems"
