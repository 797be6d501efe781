"""Recordings of later jobs of a robot whose services stay up: each is checked from the state that it began in."""

import base64
import json
import math
import zlib

import numpy as np
import pytest

from tests.checking.day_of_jobs import Day, write
from tests.checking.short_sessions import BEND
from tests.checking.test_mutations import LATE, MUTATIONS
from touchline.checking.check_session import check_recording, update_recording
from touchline.onboard.estimation.blind_run import FIRST_TICKS
from touchline.schemas import topics
from touchline.schemas.catalogue import load_vehicle
from touchline.schemas.cdr import decode, encode
from touchline.schemas.messages import ActuatorCommand, String
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.template import Template
from touchline.schemas.vehicles.shipped import SHIPPED, on_its_ground, with_its_own
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.initial_state import DamagedState, InitialState

pytestmark = pytest.mark.xdist_group("checking")
WIDE = Template(
    name="wide",
    segments=[{"id": "bow", "arc": {"center": (0.0, 5.0), "start": (0.0, 0.0), "sweep_angle": 0.3}}],
)
SLOPE_AND_SKY = {
    "ground": {"grade": 0.03, "uphill_rad": 1.0},
    "sky": [{"outline": [(-1, -1), (0.3, -1), (0.3, 1), (-1, 1)], "best_fix": "float"}],
    "faults": [{"kind": "corrections-lost", "start_s": 12.0, "duration_s": 3.0}],
}


@pytest.fixture(scope="module")
def day():
    """Five jobs with all that may happen between and amid them."""
    day = Day()
    day.job()
    day.order("refill_tank")
    day.order("replace_battery")
    day.fault(kind="messages-late", sensor="imu", delay_s=0.05, duration_s=4.0)
    day.fault(kind="messages-duplicated", sensor="gnss", share=0.5, after_s=0.3, duration_s=30.0)
    day.load()
    day.order("start")
    day.drive(450)
    day.order("pause")
    day.drive(60)
    day.order("resume")
    day.drive(50)
    day.order("abort")
    day.drive()
    day.pass_ticks(37)
    day.load_drive(1.0)
    day.order("start")
    day.drive()
    day.load()
    day.order("start")
    day.drive(480)
    day.order("estop")
    day.drive(150)
    day.order("reset")
    day.order("resume")
    day.drive()
    day.order("reset")
    day.brief_job()
    return day


def test_the_first_job_tells_no_state_and_each_later_one_does(day):
    assert len(day.begins) == 4
    assert all(len(payload) < 256 * 1024 for topic, payload in day.told if topic is topics.INITIAL_STATE)


def test_all_jobs_from_the_first_on_are_checked(day, tmp_path):
    (one,) = check_recording(write(tmp_path / "day.mcap", day.told), exact=True)
    assert one.passed, (one.problem, str(one.first))
    assert one.planned == 5
    assert not one.notes


@pytest.mark.parametrize("number", range(4))
def test_a_recording_of_later_jobs_is_checked_to_the_bit(day, tmp_path, number):
    (one,) = check_recording(write(tmp_path / "later.mcap", day.later(number)), exact=True)
    assert one.passed, (one.problem, str(one.first))
    assert one.planned == 1
    assert one.diff.topics[topics.IMU.name].pairs > 150
    assert not one.notes


@pytest.mark.parametrize("part", ["", "follower", "estimator"])
def test_a_recording_that_begins_amid_a_job_is_checked_from_the_next_one_on(day, tmp_path, part):
    path = write(tmp_path / "amid.mcap", day.recorded(day.begins[1] - 400, day.begins[2]))
    (one,) = check_recording(path, exact=True, only=part)
    assert one.passed, (one.problem, str(one.first))
    if not part:
        assert one.planned == one.diff.topics[topics.PLAN.name].pairs == 1
        assert "first job that is recorded completely" in one.notes[0]


def test_a_later_job_is_written_anew_as_it_is(day, tmp_path):
    path = write(tmp_path / "later.mcap", day.later(3))
    update_recording(path)
    (one,) = check_recording(path, exact=True)
    assert one.passed, (one.problem, str(one.first))
    assert one.diff.topics[topics.REPORT.name].pairs == 1


def test_a_job_after_one_that_went_on_from_a_process_that_died_is_checked(tmp_path):
    day = Day()
    day.load()
    day.order("start")
    day.drive(500)
    amid = len(day.told)
    day.be_killed()
    day.order("start")
    day.drive(60)
    day.order("abort")
    day.drive()
    day.brief_job()
    first, second = check_recording(write(tmp_path / "amid.mcap", day.recorded(amid)), exact=True)
    assert "no order is in the recording" in first.problem
    assert second.passed, (second.problem, str(second.first))
    (last,) = check_recording(write(tmp_path / "last.mcap", day.recorded(day.begins[-1])), exact=True)
    assert last.passed, (last.problem, str(last.first))


@pytest.mark.parametrize(
    ("vehicle", "follower"),
    [
        ("turtlebot2", "mpc"),
        *(
            pytest.param(vehicle, follower, marks=pytest.mark.full)
            for vehicle, follower in (
                ("turf-tank-two", "pure-pursuit"),
                ("turf-tank-two", "dynamic"),
                ("turf-tank-two", "pursuit-lanes"),
                ("clay-roller", "mpc"),
                ("turtlebot3-waffle-pi", "frenet"),
            )
        ),
    ],
)
def test_later_jobs_of_every_kind_of_robot_are_checked(tmp_path, vehicle, follower):
    config = with_its_own(vehicle, OnboardConfig(follower=follower))
    world = on_its_ground(vehicle, Scenario(seed=8, **({} if vehicle == "turtlebot2" else SLOPE_AND_SKY)))
    day = Day(SHIPPED[vehicle].vehicle, world, config, template=BEND if vehicle == "turf-tank-two" else WIDE)
    for _ in range(2):
        day.load()
        day.order("start")
        day.drive(700 if vehicle == "turtlebot2" else 2500)
        if day.emulator.active:
            day.order("abort")
            day.drive()
    (one,) = check_recording(write(tmp_path / "later.mcap", day.later(0)), exact=True)
    assert one.passed, (one.problem, str(one.first))
    assert one.diff.topics[topics.TRUTH.name].pairs > 100


@pytest.mark.parametrize(
    "name",
    [
        "a motor 1 % weaker",
        "whiter fixes",
        "another gain of the filter",
        pytest.param("a nozzle 1 cm off", marks=pytest.mark.full),
        "a topic that is not told",
    ],
)
def test_a_change_is_found_in_a_later_job(monkeypatch, day, tmp_path, name):
    """Values that follow from the setup are not taken from the recorded state."""
    path = write(tmp_path / "later.mcap", day.later(2 if name in LATE else 3))
    mutate, part = MUTATIONS[name]
    mutate(monkeypatch)
    (one,) = check_recording(path, exact=True)
    assert not one.passed
    assert one.part == part, str(one.first)


def begun_in(day, tmp_path, change):
    """A recording of a later job that tells as the state in which it began what `change` makes of that."""
    told = day.later(3)
    at = next(number for number, (topic, _) in enumerate(told) if topic is topics.INITIAL_STATE)
    state = change(json.loads(decode(String, told[at][1]).data))
    told[at] = topics.INITIAL_STATE, encode(String(data=json.dumps(state)))
    return write(tmp_path / "later.mcap", told)


def test_another_state_is_a_difference(day, tmp_path):
    def faster(state):
        state["command"][0][0] = 1.0
        return state

    (one,) = check_recording(begun_in(day, tmp_path, faster), exact=True)
    assert not one.passed
    assert one.part == "world"


@pytest.mark.parametrize(
    "damage",
    [
        {"tick": -1},
        {"fields": [["transport.pending_count", "<i8", [1]]], "fields_zlib": "eJz7/58OAABYBwP9"},
        {"fields_zlib": "AAAA"},
        {"faults": [[1, None, {"kind": "none"}]]},
        {"gathered": [1]},
    ],
)
def test_a_state_that_is_none_is_refused_in_a_line(day, tmp_path, damage):
    (one,) = check_recording(begun_in(day, tmp_path, lambda state: {**state, **damage}), exact=True)
    assert not one.passed
    assert "state at the job's begin" in one.problem


def of_one_actuator(state, array):
    """The state with one column of an array less, as of a drive with one actuator."""
    fields, data = [], zlib.decompress(base64.b64decode(state["fields_zlib"]))
    at, kept = 0, b""
    for path, kind, shape in state["fields"]:
        size = np.dtype(kind).itemsize * math.prod(shape)
        field = np.frombuffer(data[at : at + size], kind).reshape(shape)
        at += size
        if path == array:
            field = field[..., :-1]
        fields.append((path, kind, field.shape))
        kept += field.tobytes()
    return {"fields": fields, "fields_zlib": base64.b64encode(zlib.compress(kept)).decode()}


@pytest.mark.parametrize(
    ("field", "part"),
    [
        ("command", None),
        ("transport.readings", None),
        ("transport.history", None),
        ("body.angles_rad", None),
        ("fast.phase_rad", None),
        ("computer.buffer.measured", None),
        ("computer.buffer.measured", "estimator"),
        ("body.angles_rad", "estimator"),
    ],
)
def test_a_state_of_another_number_of_actuators_is_refused_and_the_field_named(day, tmp_path, field, part):
    def less(state):
        command = {"command": [[0.0], False, False, 0.0]}
        return state | (command if field == "command" else of_one_actuator(state, field))

    (one,) = check_recording(begun_in(day, tmp_path, less), exact=True, only=part)
    if part and field == "body.angles_rad":
        assert one.passed, (one.problem, str(one.first))  # the estimator asks for nothing of the world
        return
    assert not one.passed
    assert one.problem.startswith(f"the robot's state at the job's begin: {field} "), one.problem
    assert "\n" not in one.problem


def test_commands_of_another_number_of_actuators_are_refused(day, tmp_path):
    told = day.later(3)
    at = next(number for number, (topic, _) in enumerate(told) if topic is topics.ACTUATOR_COMMAND)
    command = decode(ActuatorCommand, told[at][1])
    one_only = command.model_copy(update={"names": command.names[:1], "values": command.values[:1]})
    told[at] = topics.ACTUATOR_COMMAND, encode(one_only)
    (one,) = check_recording(write(tmp_path / "later.mcap", told), exact=True)
    assert "values has 1 numbers, the vehicle's drive has 2 actuators" in one.problem


@pytest.fixture(scope="module")
def watchful_day():
    """Jobs of a robot with a lidar, among things, which counts on less braking after the first one."""
    objects = [{"kind": "post", "x_m": x_m, "y_m": -1.15} for x_m in (0.5, 3.5)]
    day = Day(vehicle=load_vehicle("examples/vehicles/marker-lidar.json"), scenario=Scenario(seed=5, objects=objects))
    day.job()
    day.emulator.onboard.protection.memory.hard_mps2 = 0.6
    day.load_drive(1.0)
    day.order("start")
    day.drive()
    day.brief_job()
    return day


def test_the_state_of_a_job_soon_after_switching_on_can_be_read():
    day = Day()
    while not day.emulator.onboard.estimator.ring.blind.span_ticks:
        day.emulator.tick()
    day.load_drive(1.0)
    assert InitialState.from_text(day.emulator.initial.text).tick < FIRST_TICKS


@pytest.mark.parametrize("number", range(2))
def test_what_a_robot_with_a_lidar_has_seen_and_learned_is_in_the_state(watchful_day, tmp_path, number):
    (one,) = check_recording(write(tmp_path / "later.mcap", watchful_day.later(number)), exact=True)
    assert one.passed, (one.problem, str(one.first))
    assert one.diff.topics[topics.SCAN.name].pairs > 5


@pytest.mark.parametrize(
    ("name", "value"),
    [("points_m", np.full((1, 2), math.nan)), ("points_m", np.zeros(3)), ("figures", np.array([math.inf, 0.0, 0.0]))],
)
def test_hits_that_cannot_be_are_refused(watchful_day, name, value):
    state = watchful_day.emulator.initial
    robot = Emulator(watchful_day.vehicle, watchful_day.scenario, watchful_day.config)
    with pytest.raises(DamagedState, match=r"protection\.hits"):
        robot.restore(state._replace(fields={**state.fields, f"protection.hits.{name}": value}))
