"""A fault of somebody else: one file has its fields and what it does, and no other knows it."""

import json
import math
from collections.abc import Iterator
from typing import Annotated, Literal

import pytest
from pydantic import Field

from tests.robot_sim.test_fault_timeline import robot
from touchline.schemas.errors import SpecError
from touchline.schemas.faults import Fault, describe, parse_fault
from touchline.schemas.messages import InjectFaultRequest
from touchline.schemas.plugin_packages import PluginError
from touchline.schemas.plugins import FAULTS, KindParts
from touchline.schemas.scenario import Scenario
from touchline.schemas.spec import parse
from touchline.schemas.team import TeamScenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fault_effects.acting import Acting
from touchline.services.robot_sim.fault_timeline import FaultTimeline, TimedFault
from touchline.services.robot_sim.world.effects import Effects


class Glare(Fault):
    """Reflected signals: the positions scatter more than the receiver admits."""

    kind: Literal["glare"]
    white_m: Annotated[float, Field(gt=0, le=10)] = 0.1


def glare(fault: Glare, effects: Effects, _acting: Acting) -> None:
    effects.gnss_white_m = math.hypot(effects.gnss_white_m, fault.white_m)
    effects.gnss_hidden_m = max(effects.gnss_hidden_m, fault.white_m)


class Broken(Fault):
    kind: Literal["broken"]


def broken(_fault: Broken, _effects: Effects, _acting: Acting) -> None:
    raise ZeroDivisionError("by zero")


@pytest.fixture(autouse=True)
def registered() -> Iterator[None]:
    FAULTS.register("glare", "signals are reflected", KindParts(Glare, world=glare))
    FAULTS.register("broken", "whatever", KindParts(Broken, world=broken))
    FAULTS.register("bare", "nobody has written what it does", KindParts(Broken))
    yield
    for kind in ("glare", "broken", "bare"):
        FAULTS.forget(kind)


TEXT = '{"kind": "glare", "white_m": 0.3, "start_s": 0.02, "duration_s": 0.02}'


def whites(emulator: Emulator, ticks: int) -> list[float]:
    seen = []
    for _ in range(ticks):
        emulator.tick()
        seen.append(emulator.faults.effects.gnss_white_m)
    return seen


def test_it_is_read_described_and_written_back() -> None:
    fault = parse_fault(TEXT)
    assert isinstance(fault, Glare)
    assert describe(fault) == "signals are reflected (white_m 0.3)"
    assert parse_fault(fault.model_dump_json()) == fault
    timed = TimedFault(3, 4, fault)
    assert TimedFault.from_json(json.loads(json.dumps(timed.as_json()))) == timed


def test_it_acts_by_the_scenario_as_long_as_it_says() -> None:
    scenario = parse(Scenario, f'{{"faults": [{{"kind": "bumper", "start_s": 9}}, {TEXT}]}}', "s.json")
    emulator = Emulator(Vehicle(), scenario)
    assert whites(emulator, 5) == [0.0, 0.0, 0.3, 0.3, 0.0]
    assert parse(Scenario, scenario.model_dump_json(), "s.json") == scenario
    told = [event.text for event in emulator.take_events() if event.code.startswith("fault-")]
    assert told == ["signals are reflected (white_m 0.3)", "no longer: signals are reflected"]


def test_a_robot_of_a_team_has_it() -> None:
    team = parse(TeamScenario, f'{{"robots": 2, "faults": {{"tb1": [{TEXT}]}}}}', "t.json")
    assert isinstance(team.faults["tb1"][0], Glare)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"kind": "glar"}, r"faults\[0\].kind is 'glar'; give one of gnss-outage, .*glare, .*; did you mean 'glare'\?"),
        ({"kind": "glare", "white_m": 11}, r"faults\[0\].white_m is 11; give at most 10 m"),
        ({"kind": "glare", "whit_m": 1}, r"faults\[0\].whit_m is not a known field; did you mean 'white_m'\?"),
    ],
)
def test_what_is_wrong_with_it_is_told_as_of_the_shipped_ones(given: dict[str, object], says: str) -> None:
    with pytest.raises(SpecError, match=says):
        parse(Scenario, json.dumps({"faults": [given]}), "s.json")


def test_its_schema_is_among_the_scenarios() -> None:
    kinds = Scenario.model_json_schema()["properties"]["faults"]["items"]["oneOf"]
    assert [each["properties"]["kind"]["const"] for each in kinds][-3:] == ["glare", "broken", "broken"]
    assert "white_m" in next(each for each in kinds if each["title"] == "Glare")["properties"]


def test_one_that_fails_is_refused_before_it_can_stop_the_robot() -> None:
    emulator, _, commands = robot()
    answer = commands.inject_fault(InjectFaultRequest(request_id="1", fault_json='{"kind": "broken"}'))
    assert not answer.success
    assert answer.message == 'the fault "broken" fails with ZeroDivisionError: by zero; mend it, or leave it out'
    emulator.tick()
    with pytest.raises(PluginError, match='the fault "broken" fails'):
        Emulator(Vehicle(), Scenario(faults=({"kind": "broken"},)))
    with pytest.raises(SpecError, match=r"fault.kind is 'bare', which has nothing for the world; give one that has"):
        FaultTimeline([Broken.model_construct(kind="bare", start_s=0.0, duration_s=None)], Vehicle().drive)
