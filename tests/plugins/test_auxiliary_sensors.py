"""Auxiliary sensors: two plug-ins of a folder each are measured, carried, fused, recorded and checked."""

import json
import math
from collections import Counter
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from pydantic import ValidationError

from tests.checking.day_of_jobs import Day, write
from tests.plugins import range_finder, wheel_slip_radar
from tests.robot_sim.bus_rig import setup
from tests.robot_sim.scripted import along_x
from touchline.checking.check_session import check_recording
from touchline.onboard.estimation.auxiliary_models import OnboardSensor, ScalarUpdate
from touchline.onboard.filter_model import SPEED, STATES
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.messages import SensorSample, TraversalStatus
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.plugins import FAULTS, SENSORS
from touchline.schemas.scenario import Scenario
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.initial_state import InitialState
from touchline.services.robot_sim.telemetry import MOST_TICKS, Telemetry

STRAIGHT = along_x(0, 6, sprayed=[0], speed_mps=0.8)
LINE = Template(name="line", segments=[{"id": "side", "line": {"start": (0.0, 0.0), "end": (1.5, 0.0)}}])
MOST_S = 25.0
"""A robot that pauses for a fault is watched no longer."""
WALL = (12.0, -10.0, 12.0, 10.0)
RADAR = {"kind": "wheel-slip-radar"}
LIDAR = {"kind": "range-finder", "walls": [WALL]}


@pytest.fixture(autouse=True)
def _registered():
    plugins = {"wheel-slip-radar": wheel_slip_radar.PLUGIN, "range-finder": range_finder.PLUGIN}
    for name, plugin in plugins.items():
        SENSORS.register(name, plugin.summary, plugin.make)
    FAULTS.register("radar-blind", wheel_slip_radar.FAULT.summary, wheel_slip_radar.FAULT.make)
    yield
    for name in plugins:
        SENSORS.forget(name)
    FAULTS.forget("radar-blind")


class Session:
    """A straight drive of 6 m, with what the robot says of it.

    Attributes:
        samples: Messages of auxiliary sensors, each with the tick in which it was published.
        speed_errors, east_errors: Of the estimate while it drives, every tick or every other few.
    """

    def __init__(self, *sensors, fast=True, follower="pure-pursuit", **world):
        robot = setup(follower=follower, **world)
        self.emulator = emulator = Emulator(Vehicle(sensors=sensors), robot.scenario, robot.onboard)
        self.telemetry = telemetry = Telemetry(emulator)
        emulator.load(STRAIGHT)
        telemetry.loaded(STRAIGHT, None)
        emulator.start()
        telemetry.news()
        self.samples, self.events, self.speed_errors, self.east_errors = [], [], [], []
        runner = FastRunner(emulator)
        while emulator.active and emulator.time_s < MOST_S:
            if fast:
                told = telemetry.after(runner.step(telemetry.until_due(MOST_TICKS), telemetry.rows))
            else:
                emulator.tick()
                told = telemetry.after_tick()
            for topic, payload in told:
                if topic is topics.SENSOR_SAMPLE:
                    self.samples.append((emulator.tick_count, decode(SensorSample, payload)))
                elif topic is topics.EVENTS:
                    self.events.append(payload)
            if emulator.onboard.state == TraversalStatus.RUNNING:
                self.speed_errors.append(emulator.onboard.estimate.speed_mps - emulator.world.state.speed_mps)
                self.east_errors.append(emulator.onboard.estimate.east_m - emulator.world.state.east_m)

    @property
    def hash(self):
        return self.telemetry.final.traversal.session_hash


def test_many_ticks_at_a_time_are_the_same_as_tick_by_tick():
    world = {"sensors": [LIDAR], "seed": 3}
    assert Session(RADAR, LIDAR, fast=True, **world).hash == Session(RADAR, LIDAR, fast=False, **world).hash


def test_samples_come_at_their_rate_a_latency_later_and_others_are_not_touched():
    session = Session(RADAR)
    ticks = [round(100 * sample.header.stamp.seconds) for _, sample in session.samples]
    assert {tick - measured for (tick, _), measured in zip(session.samples, ticks, strict=True)} == {3}
    assert min(after - before for before, after in pairwise(ticks)) == 5
    gaps = Counter(after - before for before, after in pairwise(ticks))
    assert gaps[5] > 0.9 * sum(gaps.values()), "a share without an echo"
    assert {(sample.kind, sample.header.frame_id) for _, sample in session.samples} == {("wheel-slip-radar", "radar")}
    assert Session().samples == []


def test_its_own_faults_and_those_of_its_messages_act_on_it():
    blind = {"kind": "radar-blind", "start_s": 2.0, "duration_s": 1.0}
    late = {"kind": "messages-late", "sensor": "wheel-slip-radar", "delay_s": 0.1, "start_s": 4.0, "duration_s": 1.0}
    samples = Session(RADAR, faults=[blind, late]).samples
    measured = [round(100 * sample.header.stamp.seconds) for _, sample in samples]
    assert [tick for tick in measured if 201 <= tick <= 300] == []
    delays = {tick - then for (tick, _), then in zip(samples, measured, strict=True) if 401 <= then <= 500}
    assert delays == {13}


def test_a_radar_sees_wheels_slip():
    """Without fixes, wheels that lose a fifth of their speed carry the estimate away; here a fifth as far."""
    faults = [
        {"kind": "gnss-outage", "start_s": 3.5},
        {"kind": "wheel-slip", "actuator": "all", "share": 0.2, "start_s": 4.0},
    ]
    without, with_radar = (np.abs(Session(*sensors, faults=faults).east_errors).max() for sensors in ([], [RADAR]))
    assert with_radar < 0.3 * without


def test_ranges_to_a_known_wall_place_the_robot():
    world = {"faults": [{"kind": "gnss-degraded", "fix": "single", "start_s": 3.0}], "sensors": [LIDAR], "seed": 5}
    without, with_lidar = Session(**world), Session(LIDAR, **world)
    used, rejected = (getattr(with_lidar.emulator.onboard.auxiliary, name)["lidar"] for name in ("used", "rejected"))
    assert used > 20 * max(rejected, 1)
    assert np.abs(with_lidar.east_errors).max() < 0.7 * np.abs(without.east_errors).max()


class Wild(OnboardSensor):
    """Claims a speed of 100 m/s."""

    def updates(self, values, state):
        jacobian = np.zeros(STATES)
        jacobian[SPEED] = 1.0
        return [ScalarUpdate(100.0, jacobian, 1e-4)]


class Failing(OnboardSensor):
    def updates(self, values, state):
        return [ScalarUpdate(math.nan, np.zeros(STATES), 1.0)]


@pytest.mark.parametrize("model", [Wild, Failing])
def test_a_sensor_that_lies_or_fails_does_no_harm(model):
    parts = wheel_slip_radar.PLUGIN.make
    SENSORS.forget("wheel-slip-radar")
    SENSORS.register("wheel-slip-radar", "", replace(parts, onboard=model))
    session = Session(RADAR)
    failed = [event for event in session.events if b"sensor-failed" in event]
    assert len(failed) == (model is Failing)
    assert np.abs(session.speed_errors).max() < 0.2
    assert session.emulator.onboard.auxiliary.used["radar"] == 0


def test_what_is_under_way_belongs_to_the_state_at_a_jobs_begin():
    session = Session(RADAR)
    emulator = session.emulator
    while not emulator.auxiliary.under_way:
        emulator.tick()
    emulator.load(STRAIGHT)
    again = InitialState.from_text(emulator.initial.text)
    assert again.under_way == emulator.initial.under_way != ()


def test_without_noise_nothing_is_drawn():
    session = Session(RADAR, noise="none")
    standing = [sample.values[0] for tick, sample in session.samples if tick < 20]
    assert standing == [0.0] * len(standing) != []


@pytest.mark.parametrize(
    ("sensors", "place"),
    [
        ([{"kind": "sonar"}], "sensors.0.kind"),
        ([{"name": "radar"}], "sensors.0.kind"),
        ([RADAR, RADAR], "sensors.name"),
        ([{**RADAR, "sigma_mps": -1.0}], "sensors.0.sigma_mps"),
    ],
)
def test_a_wrong_sensor_is_refused_by_its_field(sensors, place):
    with pytest.raises(ValidationError) as refused:
        Vehicle(sensors=sensors)
    assert [".".join(map(str, each["loc"])) for each in refused.value.errors()] == [place]


def test_vehicles_and_scenarios_without_sensors_are_written_as_before():
    assert "sensors" not in json.loads(Vehicle().model_dump_json())
    assert "sensors" not in json.loads(Scenario().model_dump_json())
    scenario = Scenario(sensors=[LIDAR])
    assert Scenario.model_validate_json(scenario.model_dump_json()) == scenario


def test_a_recording_of_them_passes_every_check(tmp_path):
    vehicle, world = Vehicle(sensors=[RADAR, LIDAR]), Scenario(seed=3, sensors=[LIDAR])
    day = Day(vehicle, world, OnboardConfig(follower="pure-pursuit"), template=LINE)
    for _ in range(2):
        day.load()
        day.order("start")
        day.drive(6000)
        assert day.emulator.onboard.state == TraversalStatus.DONE, day.emulator.onboard.status.reason
    path = write(tmp_path / "auxiliary.mcap", day.told)
    for only in ("", "estimator", "follower"):
        (one,) = check_recording(path, exact=True, **({"only": only} if only else {}))
        assert one.passed, (only, one.problem, str(one.first))
