"""Faults in time: when they act, how they add up, and who hears of it."""

import json
import math
from operator import attrgetter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.robot_sim.open_loop import fault
from tests.robot_sim.scripted import ScriptedOnboard, line_script
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.errors import CommandRefused, SpecError
from touchline.schemas.faults import fault_models, parse_fault
from touchline.schemas.messages import Event, InjectFaultRequest
from touchline.schemas.plugins import SENSORS
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.command_handlers import Commands
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fault_timeline import MAX_FAULTS, FaultTimeline
from touchline.services.robot_sim.telemetry import Telemetry
from touchline.services.robot_sim.world.effects import Effects

DRIVE = Vehicle().drive


def acting(timeline, effect, ticks):
    """The ticks in which one of the effects that are numbers is not neutral."""
    found = []
    for tick in range(1, ticks + 1):
        timeline.step(tick)
        if getattr(timeline.effects, effect) != getattr(Effects.sized(2)(), effect):
            found.append(tick)
    return found


def test_a_fault_acts_from_its_start_for_its_duration():
    bumped = fault("bumper", start_s=0.1, duration_s=0.05)
    assert acting(FaultTimeline([bumped], DRIVE), "bumper", 40) == [11, 12, 13, 14, 15]
    assert acting(FaultTimeline([fault("bumper", duration_s=0.01)], DRIVE), "bumper", 40) == [1]
    assert acting(FaultTimeline([fault("bumper", start_s=0.37)], DRIVE), "bumper", 40) == [38, 39, 40]
    for hundredths in (7, 14, 28, 29, 57, 58):  # 0.29 · 100 is less than 29
        short = fault("bumper", start_s=hundredths / 100, duration_s=hundredths / 100)
        acts = acting(FaultTimeline([short], DRIVE), "bumper", 130)
        assert acts == list(range(hundredths + 1, 2 * hundredths + 1))


def test_overlapping_faults_add_up_and_end_one_by_one():
    timeline = FaultTimeline(
        [
            fault("gnss-wrong-fix", east_m=1.0, duration_s=0.2),
            fault("gnss-wrong-fix", east_m=0.5, start_s=0.1, duration_s=0.2),
            fault("nozzle-clogged", share=0.4, duration_s=0.2),
            fault("nozzle-clogged", share=0.6, start_s=0.1, duration_s=0.2),
        ],
        DRIVE,
    )
    seen = []
    for tick in range(1, 41):
        timeline.step(tick)
        seen.append((timeline.effects.gnss_offset_m[0], timeline.effects.flow_share))
    assert [seen[tick - 1] for tick in (1, 10, 11, 20, 21, 30, 31)] == [
        (1.0, 0.4),
        (1.0, 0.4),
        (1.5, 0.4),
        (1.5, 0.4),
        (0.5, 0.6),
        (0.5, 0.6),
        (0.0, 1.0),
    ]
    assert same(timeline.effects, Effects.sized(2)())


def effects_of(*faults):
    timeline = FaultTimeline(faults, DRIVE)
    timeline.step(1)
    return timeline.effects


def sensor(which, what):
    return f"messages.{what}", SENSORS.number(which)


def amount(effects, place):
    """The value of an effect: of a name, or of a name and a number in its array."""
    name, *number = (place,) if isinstance(place, str) else place
    value = attrgetter(name)(effects)
    return value[number[0]] if number else value


def amounts_of(effects):
    """All of them, one after another."""
    return np.concatenate([value.ravel() for part in (effects, effects.messages) for value in part.views.values()])


def same(effects, others):
    return effects.array.tobytes() == others.array.tobytes()


def pair(kind, field, mild, worse, **others):
    """Two faults of a kind that differ in a field."""
    return fault(kind, **{field: mild}, **others), fault(kind, **{field: worse}, **others)


WORSE = [  # a fault and a worse one, where it is told, and what the worse one alone amounts to
    (*pair("wheel-slip", "share", 0.1, 0.4), ("slip", 0), 0.4),
    (*pair("wheel-slip", "share", 0.1, -0.4), ("slip", 1), -0.4),
    (*pair("motor-weak", "share", 0.5, 0.2), ("torque_share", 0), 0.2),
    (*pair("nozzle-clogged", "share", 0.5, 0.2), "flow_share", 0.2),
    (*pair("battery-low", "fraction", 0.5, 0.2), "battery_share", 0.2),
    (*pair("tank-empty", "litres", 5.0, 2.0), "tank_max_l", 2.0),
    (*pair("valve-stuck", "position", "closed", "open"), "valve", 1.0),
    (*pair("disc-stuck", "position", "up", "down"), "disc", 1.0),
    (*pair("gnss-degraded", "fix", "float", "single"), "fix_cap", 1.0),
    (fault("gnss-degraded"), fault("gnss-outage"), "fix_cap", 0.0),
    (*pair("gnss-degraded", "claimed_m", 0.5, 0.1), "claimed_m", 0.1),
    (fault("gnss-degraded"), fault("gnss-degraded", claimed_m=0.1), "claimed_m", 0.1),
    (*pair("messages-lost", "share", 0.1, 0.3, sensor="imu"), sensor("imu", "lost_share"), 0.3),
    (*pair("messages-reordered", "spread_s", 0.1, 0.3, sensor="gnss"), sensor("gnss", "spread_ticks"), 30.0),
    (*pair("messages-duplicated", "after_s", 0.1, 0.3, sensor="encoder"), sensor("encoder", "again_ticks"), 30.0),
    (
        *pair("messages-duplicated", "share", 0.1, 0.3, sensor="magnetometer"),
        sensor("magnetometer", "again_share"),
        0.3,
    ),
]


@pytest.mark.parametrize(("mild", "worse", "place", "amounts"), WORSE)
def test_of_two_the_worse_counts_whichever_began_first(mild, worse, place, amounts):
    assert amount(effects_of(worse), place) == amounts
    assert amount(effects_of(mild), place) != amounts
    assert amount(effects_of(mild, worse), place) == amount(effects_of(worse, mild), place) == amounts


SUMS = [  # what adds up, and to what
    ({"kind": "gnss-wrong-fix", "east_m": 0.0, "north_m": 0.2}, ("gnss_offset_m", 1), 0.4),
    ({"kind": "clock-skew", "offset_s": 0.1}, "clock_offset_s", 0.2),
    ({"kind": "clock-skew", "drift_ppm": 100.0}, "clock_drift", 2e-4),
    ({"kind": "imu-bias", "gyro_radps": 0.1}, "gyro_bias_radps", 0.2),
    ({"kind": "imu-bias", "accel_mps2": 0.1}, "accel_bias_mps2", 0.2),
    ({"kind": "magnetic-disturbance", "east_t": 1e-6}, "field_east_t", 2e-6),
    ({"kind": "magnetic-disturbance", "north_t": 1e-6}, "field_north_t", 2e-6),
    ({"kind": "messages-late", "sensor": "gnss", "delay_s": 0.2}, sensor("gnss", "late_ticks"), 40.0),
    # White noises do so as independent ones: by their squares.
    ({"kind": "imu-noisy", "gyro_radps": 0.3}, "gyro_white_radps", 0.3 * math.sqrt(2)),
    ({"kind": "imu-noisy", "accel_mps2": 0.3}, "accel_white_mps2", 0.3 * math.sqrt(2)),
    ({"kind": "gnss-noisy", "white_m": 0.3}, "gnss_white_m", 0.3 * math.sqrt(2)),
    ({"kind": "gnss-noisy", "white_m": 0.3, "honest": False}, "gnss_hidden_m", 0.3 * math.sqrt(2)),
]


@pytest.mark.parametrize(("fields", "place", "twice"), SUMS)
def test_offsets_delays_and_noises_add_up(fields, place, twice):
    fault = parse_fault(json.dumps(fields))
    assert amount(effects_of(fault, fault), place) == pytest.approx(twice, rel=1e-12)


@pytest.mark.parametrize(("delay_s", "ticks"), [(0.29, 29), (0.57, 57), (0.001, 1), (5.0, 500)])
def test_a_delay_is_told_in_whole_ticks_and_is_one_at_least(delay_s, ticks):
    late = fault("messages-late", sensor="encoder", delay_s=delay_s)
    assert amount(effects_of(late), sensor("encoder", "late_ticks")) == ticks


TIMES = {"start_s": st.just(0.0), "duration_s": st.none()}
NEEDED = {"delay_s": st.floats(0.01, 5), "white_m": st.floats(0.001, 100), "share": st.floats(0, 0.95)}
NEEDED["sensor"] = st.sampled_from(SENSORS.names())
ANY_FAULT = st.one_of(
    [
        st.builds(model, **TIMES, **{k: v for k, v in NEEDED.items() if k in model.model_fields})
        for model in fault_models().values()
    ]
)


@given(st.lists(ANY_FAULT, min_size=2, max_size=6), st.randoms(use_true_random=False))
def test_the_order_of_faults_does_not_matter(faults, rng):
    mixed = list(faults)
    rng.shuffle(mixed)
    assert amounts_of(effects_of(*mixed)) == pytest.approx(amounts_of(effects_of(*faults)), rel=1e-12)


def test_an_injected_fault_counts_from_now():
    timeline = FaultTimeline([], DRIVE)
    timeline.step(100)
    timeline.inject(fault("bumper", start_s=0.02, duration_s=0.02), 100)
    assert [tick for tick in acting(timeline, "bumper", 110) if tick > 100] == [103, 104]


def test_there_is_an_end_to_injecting_and_faults_that_are_over_make_room_for_others():
    timeline = FaultTimeline([], DRIVE)
    for _ in range(MAX_FAULTS):
        timeline.inject(fault("bumper", duration_s=0.05), 0)
    with pytest.raises(CommandRefused, match="faults"):
        timeline.inject(fault("bumper"), 0)
    for tick in range(1, 8):
        timeline.step(tick)
    timeline.inject(fault("operator-lost"), 7)
    assert acting(timeline, "operator_lost", 9)[-2:] == [8, 9]


def test_an_injection_says_when_and_for_how_long():
    timeline = FaultTimeline([], DRIVE)
    timeline.inject(fault("wheel-slip", actuator="left", share=0.3, start_s=1.5), 100)
    (event,) = timeline.take_events()
    assert event.text == "a wheel slips (actuator left, share 0.3), in 1.5 s, to the end"


def robot(*faults):
    emulator = Emulator(Vehicle(), Scenario(faults=faults), onboard=ScriptedOnboard(line_script))
    telemetry = Telemetry(emulator)
    return emulator, telemetry, Commands(emulator, telemetry, lambda _factor: None)


def test_the_command_is_answered_applied_from_the_next_tick_and_recorded():
    emulator, telemetry, commands = robot()
    emulator.tick()
    answer = commands.inject_fault(
        InjectFaultRequest(request_id="1", fault_json='{"kind": "bumper", "duration_s": 0.02}')
    )
    assert answer.success
    said = [decode(Event, payload) for topic, payload in commands.take() if topic is topics.EVENTS]
    assert [event.code for event in said] == ["fault-injected"]
    assert "bumper is pressed, now, for 0.02 s" in said[0].text
    telemetry.after_tick()
    seen, said = [], []
    for _ in range(4):
        emulator.tick()
        seen.append(emulator.frame.bumper)
        said += [decode(Event, payload) for topic, payload in telemetry.after_tick() if topic is topics.EVENTS]
    assert seen == [True, True, False, False]
    assert [event.code for event in said] == ["fault-begins", "fault-ends"]


@pytest.mark.parametrize("text", ["", "bumper", '{"kind": "gremlins"}', '{"kind": "bumper", "start_s": -3}'])
def test_a_bad_command_is_refused_with_a_reason_and_changes_nothing(text):
    emulator, _, commands = robot()
    answer = commands.inject_fault(InjectFaultRequest(request_id="1", fault_json=text))
    assert not answer.success
    assert "fault" in answer.message
    assert commands.take() == []
    emulator.tick()
    assert same(emulator.faults.effects, Effects.sized(2)())


@pytest.mark.parametrize(("actuator", "slots"), [("left", [1, 0]), ("right", [0, 1]), ("all", [1, 1])])
def test_a_fault_is_of_the_actuators_that_it_names(actuator, slots):
    assert effects_of(fault("wheel-blocked", actuator=actuator)).blocked[:2].tolist() == slots
    assert effects_of(fault("encoder-dropout", actuator=actuator)).encoder_out[:2].tolist() == slots


def test_a_fault_of_an_actuator_that_the_vehicle_does_not_have_is_refused():
    scenario = Scenario(faults=(fault("bumper"), fault("motor-weak", actuator="front")))
    says = r"scenario: faults\[1\].actuator is 'front'; give 'left', 'right' or 'all': the vehicle's drive has no other"
    with pytest.raises(SpecError, match=says):
        Emulator(Vehicle(), scenario)
    timeline = FaultTimeline([], DRIVE)
    with pytest.raises(SpecError, match=r"fault: actuator is 'rear'; give 'left', 'right' or 'all'"):
        timeline.inject(fault("wheel-slip", actuator="rear"), 0)
    timeline.step(1)
    assert same(timeline.effects, Effects.sized(2)())
    assert timeline.take_events() == []
