"""Faults as an author writes them: every kind, and what is wrong with the wrong ones."""

import json
from typing import get_args

import pytest

from touchline.schemas.errors import SpecError
from touchline.schemas.faults import describe, fault_models, parse_fault
from touchline.schemas.scenario import Scenario
from touchline.schemas.spec import parse

KINDS = tuple(fault_models().values())
REQUIRED = {
    "messages-late": {"sensor": "imu", "delay_s": 0.2},
    "messages-duplicated": {"sensor": "gnss"},
    "messages-reordered": {"sensor": "gnss"},
    "messages-lost": {"sensor": "encoder"},
    "valve-stuck": {"position": "open"},
    "disc-stuck": {"position": "up"},
}


def kind_of(model):
    return get_args(model.model_fields["kind"].annotation)[0]


@pytest.mark.parametrize("model", KINDS, ids=kind_of)
def test_every_kind_is_read_described_and_written_back(model):
    text = json.dumps({"kind": kind_of(model), "start_s": 2.0, "duration_s": 1.5, **REQUIRED.get(kind_of(model), {})})
    fault = parse_fault(text)
    assert isinstance(fault, model)
    assert (fault.start_s, fault.duration_s) == (2.0, 1.5)
    assert describe(fault).startswith(fault.summary)
    assert parse_fault(fault.model_dump_json()) == fault
    scenario = parse(Scenario, json.dumps({"faults": [json.loads(text)]}), "s.json")
    assert scenario.faults == (fault,)


@pytest.mark.parametrize(
    ("fault", "field", "says"),
    [
        ({"kind": "gremlins"}, "faults[1].kind", "'gremlins'"),
        ({"start_s": 1}, "faults[1].kind", "is missing"),
        ({"kind": "bumper", "start_s": -1}, "faults[1].start_s", "give at least 0 s"),
        ({"kind": "bumper", "duration_s": 0}, "faults[1].duration_s", "give at least 0.01 s"),
        ({"kind": "bumper", "start_s": float("nan")}, "faults[1].start_s", "is nan"),
        ({"kind": "bumper", "wheel": "left"}, "faults[1].wheel", "not a known field"),
        ({"kind": "wheel-blocked", "actuator": 1}, "faults[1].actuator", "is 1"),
        ({"kind": "wheel-slip", "actuator": "left", "wheel": "left"}, "faults[1].wheel", "not a known field"),
        ({"kind": "messages-late", "sensor": "gnss"}, "faults[1].delay_s", "is missing"),
        ({"kind": "valve-stuck"}, "faults[1].position", "is missing"),
        ({"kind": "nozzle-clogged", "share": 1.5}, "faults[1].share", "give at most 1"),
        ("bumper", "faults[1]", "bumper"),
    ],
)
def test_a_bad_fault_is_refused_with_its_place_and_reason(fault, field, says):
    with pytest.raises(SpecError) as caught:
        parse(Scenario, json.dumps({"faults": [{"kind": "bumper"}, fault]}), "s.json")
    assert caught.value.field == field
    assert says in str(caught.value)


@pytest.mark.parametrize("text", ["", "{", "[]", "null", '{"kind": "bumper"}, "fault": 1', '{"kind": "bumper"}}'])
def test_what_is_no_fault_is_refused(text):
    with pytest.raises(SpecError):
        parse_fault(text)


def test_silence_keeps_the_faults():
    scenario = Scenario(noise="none", faults=({"kind": "bumper"},))
    assert scenario.effective().faults == scenario.faults


@pytest.mark.parametrize("kind", ["encoder-dropout", "wheel-blocked", "wheel-slip", "motor-weak"])
@pytest.mark.parametrize(("former", "now"), [("left", "left"), ("right", "right"), ("both", "all")])
def test_the_wheel_of_an_older_file_is_an_actuator(kind, former, now):
    older, newer = (
        parse_fault(f'{{"kind": "{kind}", "wheel": "{former}"}}'),
        parse_fault(f'{{"kind": "{kind}", "actuator": "{now}"}}'),
    )
    assert older == newer
    assert f"actuator {now}" in describe(older)
