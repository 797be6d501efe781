"""Step interface: the bits of `simulate` with the same policy, the end of a drive, and what is refused."""

import math

import pytest

import touchline
from tests.api.test_simulated import pursue
from touchline.schemas.faults import parse_fault

OUTAGE = '{"kind": "gnss-outage", "start_s": 4.0, "duration_s": 8.0}'
BUMPER = '{"kind": "bumper", "start_s": 6.0, "duration_s": 1.0}'


@pytest.fixture(scope="module")
def plan() -> touchline.Plan:
    return touchline.plan("study-square")


def drive(emulator: touchline.Emulator) -> None:
    while not emulator.done:
        emulator.step(pursue(emulator.state, emulator.ahead))


@pytest.mark.parametrize(
    ("fault", "reason"), [(None, ""), (OUTAGE, ""), (BUMPER, "the bumper is pressed")], ids=("none", "pause", "stop")
)
def test_a_policy_drives_as_in_a_simulation(plan: touchline.Plan, fault: str | None, reason: str) -> None:
    scenario = touchline.Scenario(faults=() if fault is None else (parse_fault(fault),))
    run = touchline.simulate(plan, scenario=scenario, seed=7, follower=pursue)
    rows = run.frame(kind="numpy")
    assert ("paused" in rows["state"]) == (fault is OUTAGE)
    emulator = touchline.Emulator(plan, scenario=scenario)
    emulator.reset(seed=7)
    drive(emulator)
    assert emulator.reason == reason
    last = rows[rows["time_s"] == emulator.time_s]
    assert emulator.truth == tuple(float(last[f"truth_{name}"][0]) for name in emulator.truth._fields)
    assert emulator.estimate == tuple(float(last[f"estimate_{name}"][0]) for name in emulator.estimate._fields)
    if not reason:
        assert emulator.report == run.report.model_copy(update={"session_hash": ""})


def test_a_reset_begins_anew(plan: touchline.Plan) -> None:
    emulator = touchline.Emulator(plan, seed=3)
    first = emulator.frame
    assert first.time_s == emulator.time_s > 0.0
    frames = [emulator.step((0.5, 0.1)) for _ in range(5)]
    assert [frame.tick - first.tick for frame in frames] == [1, 2, 3, 4, 5]
    assert emulator.reset() == first
    assert emulator.step((0.5, 0.1), ticks=5) == frames[-1]
    assert emulator.reset(seed=4) != first and emulator.seed == 4


def test_actuators_are_commanded(plan: touchline.Plan) -> None:
    emulator = touchline.Emulator(plan)
    emulator.step((2.0, 2.0), actuators=True, ticks=100)
    assert emulator.truth.speed_mps > 0.1 and abs(emulator.truth.yaw_rate_radps) < 0.1


@pytest.mark.parametrize("command", [(math.nan, 0.0), (1.0,), (1.0, 2.0, 3.0), "go", None])
def test_what_is_no_command_is_refused(plan: touchline.Plan, command: object) -> None:
    emulator = touchline.Emulator(plan)
    with pytest.raises(touchline.SpecError, match="give 2 finite numbers: speed, yaw rate"):
        emulator.step(command)  # type: ignore[arg-type]
    with pytest.raises(touchline.SpecError, match="give 2 finite numbers: left, right"):
        emulator.step(command, actuators=True)  # type: ignore[arg-type]


def test_what_cannot_be_is_refused(plan: touchline.Plan) -> None:
    emulator = touchline.Emulator(plan)
    with pytest.raises(touchline.SpecError, match=r"actuator 'right'.*give -\d+ to"):
        emulator.step((0.0, 99.0), actuators=True)
    with pytest.raises(touchline.SpecError, match="ticks"):
        emulator.step((0.0, 0.0), ticks=0)
    with pytest.raises(touchline.SpecError, match="seed"):
        emulator.reset(seed=-1)
    emulator.step((1.0, 0.0), ticks=3000)
    assert emulator.done and "left its plan's surroundings" in emulator.reason
    with pytest.raises(touchline.SpecError, match="call reset first"):
        emulator.step((0.0, 0.0))
