"""The loop kernel does what the ticks one by one do, and says what they say, to the bit, whatever happens."""

import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks._data_sheets import data_sheets
from tests.robot_sim.scripted import trajectory
from tests.with_full import with_full
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.curves import Curve
from touchline.schemas.messages import Event, TraversalStatus
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import GnssNoise, Scenario
from touchline.schemas.template import Template
from touchline.schemas.truth import Truth
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.telemetry import Telemetry

ARC = Curve.from_arc((2, 0), (2, 1.5), 0.8)
PLAN = trajectory(
    [
        Curve.from_line((0, 0), (0.5, 0)),
        Curve.from_line((0.5, 0), (2, 0)),
        ARC,
        Curve(*(float(value) for value in ARC.at(ARC.length_m)[:3]), 0.0, 1.0),
    ],
    [0, 1, 1, 0],
    ids=["t0", "line", "arc", "t1"],
    speed_mps=0.8,
)
TEMPLATE = Template(name="one", segments=[{"id": "line", "line": {"start": (0.5, -0.41124), "end": (2.0, -0.41124)}}])
FOLLOWERS = ("mpc", "pure-pursuit")
LONGEST_TICKS = 1100
QUICK = {"reacquire_s": 0.5, "float_after_s": 0.5, "converge_min_s": 1.0, "converge_max_s": 1.0}
"""A receiver that finds its fix again while there is some way left."""
FAULTS = {
    "gnss-outage": {},
    "gnss-degraded": {"fix": "float", "claimed_m": 0.01},
    "corrections-lost": {},
    "messages-late": {"sensor": "gnss", "delay_s": 0.2},
    "messages-lost": {"sensor": "imu", "share": 0.3},
    "messages-duplicated": {"sensor": "gnss", "share": 0.5},
    "clock-skew": {"offset_s": 0.02},
    "imu-bias": {"gyro_radps": 0.05},
    "imu-stuck": {},
    "encoder-dropout": {"actuator": "left"},
    "wheel-blocked": {"actuator": "left"},
    "wheel-slip": {"actuator": "right", "share": 0.5},
    "valve-stuck": {"position": "open"},
    "nozzle-clogged": {},
    "bumper": {},
    "tank-empty": {},
    "operator-lost": {},
}
IN_TURN = (
    ("messages-late", "nozzle-clogged", "gnss-outage"),
    ("messages-duplicated", "corrections-lost", "gnss-degraded"),
    ("messages-lost", "operator-lost", "imu-stuck"),
    ("valve-stuck", "wheel-slip", "wheel-blocked"),
    ("clock-skew", "encoder-dropout", "bumper"),
    ("imu-bias", "tank-empty"),
)
"""Faults of one session, one after the other: those that stop the robot come last."""


def session(scenario, listen_from, *, loop, follower="mpc", plan=PLAN, template=TEMPLATE, vehicle=None, **sheets):
    """(every payload from a tick on, the report, the tick it ended in, the track that tells of wet paint)."""
    config = OnboardConfig(follower=follower, **sheets) if sheets else data_sheets(scenario, follower=follower)
    emulator = Emulator(vehicle or Vehicle(), scenario, config)
    emulator.load(plan, template)
    emulator.start()
    runner = FastRunner(emulator)
    if loop:
        runner.run(listen_from)
    else:
        for _ in range(listen_from):
            if emulator.active:
                emulator.tick()
    telemetry = Telemetry(emulator)
    said = list(telemetry.news())
    at_once = 1 + listen_from % 12
    while emulator.active and emulator.tick_count < LONGEST_TICKS:
        if loop:
            most = min(at_once, LONGEST_TICKS - emulator.tick_count)
            said += telemetry.after(runner.step(telemetry.until_due(most), telemetry.rows))
        else:
            emulator.tick()
            said += telemetry.after_tick()
    return said, telemetry.reports().traversal, emulator.tick_count, emulator.work.track.rows.tolist()


def assert_same(scenario, listen_from, **things):
    looped, ticked = (session(scenario, listen_from, loop=loop, **things) for loop in (True, False))
    assert looped[1:] == ticked[1:]
    assert [topic.name for topic, _ in looped[0]] == [topic.name for topic, _ in ticked[0]]
    for (topic, payload), (_, other) in zip(looped[0], ticked[0], strict=True):
        assert payload == other, (topic.name, decode(topic.type, payload), decode(topic.type, other))
    return looped


@pytest.mark.parametrize(
    ("follower", "listen_from"),
    with_full(("pure-pursuit", 1), ("mpc", 57), ("mpc", 9999), full=itertools.product(FOLLOWERS, (7, 500))),
)
def test_the_loop_is_the_ticks(follower, listen_from):
    _, report, _, track = assert_same(Scenario(seed=4, gnss=GnssNoise.white_tail()), listen_from, follower=follower)
    assert len(track) > 30
    assert report.success
    assert report.coverage_pct > 90.0


@pytest.mark.parametrize(
    ("truth", "sheets", "said"),
    [
        ({}, {"gnss": {"stamp_offset_s": 0.05}}, "stamp offset differs from the robot's files by -"),
        ({"wander_rad": 0.02}, {}, ""),
    ],
    ids=["stamps", "wander"],
)
def test_a_robot_tells_what_its_files_are_wrong_about(truth, sheets, said):
    payloads, *_ = assert_same(Scenario(seed=4, truth=Truth(**truth)), 300, follower="pure-pursuit", **sheets)
    events = [decode(Event, payload) for topic, payload in payloads if topic is topics.EVENTS]
    texts = [event.text for event in events if event.code == "files-differ"]
    assert len(texts) == bool(said)
    assert all(text.startswith(said) for text in texts)


@pytest.mark.parametrize(
    ("kinds", "listen_from"),
    with_full(*zip(IN_TURN, itertools.cycle((359, LONGEST_TICKS))), full=(((kind,), 359) for kind in FAULTS)),
    ids=str,
)
def test_the_loop_is_the_ticks_whatever_goes_wrong(kinds, listen_from):
    faults = [
        {"kind": kind, "start_s": 3.0 + 0.75 * i, "duration_s": 0.5, **FAULTS[kind]} for i, kind in enumerate(kinds)
    ]
    scenario = Scenario.model_validate({"seed": 2, "gnss": QUICK, "faults": faults})
    assert_same(scenario, listen_from, follower="pure-pursuit")


@pytest.mark.full
@settings(max_examples=20, deadline=None)
@given(
    st.integers(0, 2**63 - 1),
    st.integers(1, 800),
    st.sampled_from(FOLLOWERS),
    st.lists(st.tuples(st.sampled_from(sorted(FAULTS)), st.floats(0.0, 7.0), st.floats(0.01, 1.5)), max_size=3),
)
def test_the_loop_is_the_ticks_on_any_day(seed, listen_from, follower, timeline):
    faults = [
        {"kind": kind, "start_s": start_s, "duration_s": duration_s, **FAULTS[kind]}
        for kind, start_s, duration_s in timeline
    ]
    scenario = Scenario.model_validate({"seed": seed, "gnss": QUICK, "faults": faults})
    assert_same(scenario, listen_from, follower=follower)


def test_commands_between_two_runs_act_as_between_ticks():
    ends = []
    for loop in (True, False):
        emulator = Emulator(Vehicle(), Scenario(), OnboardConfig(follower="pure-pursuit"))
        emulator.load(PLAN, TEMPLATE)
        emulator.start()
        runner = FastRunner(emulator)
        for command in (emulator.pause, emulator.resume, emulator.estop):
            for _ in range(1 if loop else 300):
                runner.run(300) if loop else emulator.tick()
            if emulator.onboard.state != TraversalStatus.DONE:
                command()
        for _ in range(100):
            emulator.tick()
        ends.append((emulator.world.state.array.tobytes(), emulator.onboard.status, emulator.take_events()))
    assert ends[0] == ends[1]


def test_nearly_all_ticks_are_nominal(monkeypatch):
    emulator = Emulator(Vehicle(), Scenario(), OnboardConfig(follower="pure-pursuit"))
    emulator.load(PLAN, TEMPLATE)
    emulator.start()
    alone = []
    monkeypatch.setattr(emulator, "tick", lambda tick=emulator.tick: (alone.append(emulator.tick_count), tick()))
    runner = FastRunner(emulator)
    while emulator.active:
        runner.run(100)
    driving = [tick for tick in alone if 100 < tick < emulator.tick_count - 150]
    assert len(driving) < 0.1 * emulator.tick_count
