"""A drive of four actuators is planned for, driven, recorded and checked, and no file but its own knows it."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.checking.day_of_jobs import Day, write
from tests.command import app
from tests.plugins.skid_steer import registered
from tests.plugins.skid_steer.spec import WHEELS, SkidSteerDrive
from touchline.checking.check_session import check_recording
from touchline.onboard import tracking_state as tracking
from touchline.onboard.drives import onboard_drive
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.interface import Command
from touchline.recordings.channels import topic_at
from touchline.recordings.reader import RecordingReader
from touchline.schemas import topics
from touchline.schemas.catalogue import load_template
from touchline.schemas.cdr import decode
from touchline.schemas.messages import ActuatorCommand, JointState, TraversalReport, TraversalStatus
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.sensors.suite import Sensors
from touchline.services.robot_sim.world.effects import Effects
from touchline.services.robot_sim.world.world import World

pytestmark = pytest.mark.xdist_group("skid-steer")  # its kernels are compiled once
QUIET = Scenario(noise="none")
LINE = Template(name="line", segments=[{"id": "side", "line": {"start": (0.0, 0.0), "end": (1.5, 0.0)}}])


@pytest.fixture(autouse=True)
def skid_steer() -> Iterator[None]:
    with registered():
        yield


def crawler() -> Vehicle:
    return Vehicle(name="crawler", drive=SkidSteerDrive())


def test_its_commands_and_its_twist_are_inverse() -> None:
    figures, now = drive_of(crawler()).figures, np.zeros(tracking.COMMAND + len(WHEELS))
    now[tracking.EFFECT : tracking.EFFECT + 2] = figures.radius_m
    wheels = np.array(onboard_drive.actuators_of(figures, 0.6, -0.4, now))
    assert onboard_drive.twist(figures, wheels, now) == pytest.approx((0.6, -0.4))
    for wheel in range(len(WHEELS)):
        faster = wheels.copy()
        faster[wheel] += 1.0
        difference = np.subtract(onboard_drive.twist(figures, faster, now), (0.6, -0.4))
        assert onboard_drive.gain(figures, wheel, now) == pytest.approx(tuple(difference))


def test_there_is_a_place_for_each_wheel() -> None:
    world, sensors = World(crawler(), QUIET), Sensors(crawler(), QUIET)
    frame = sensors.frame(0, 0, world.state, Effects.sized(len(WHEELS))())
    assert len(frame.encoders) == len(world.state.angles_rad) == len(world.drive.rate_radps) == len(WHEELS)


@pytest.mark.full  # world and sensors take 12 s to compile for four actuators
def test_each_wheel_has_its_encoder() -> None:
    vehicle = crawler()
    world, sensors = World(vehicle, QUIET), Sensors(vehicle, QUIET)
    for tick in range(1, 101):
        world.step(Command((4.0, 6.0, 4.2, 6.2), False, False), tick)
        encoders = sensors.read(tick, world.state).encoders
    assert encoders == pytest.approx(world.state.angles_rad, abs=2e-4)
    assert encoders[0] < encoders[2] < encoders[1] < encoders[3]
    assert world.state.yaw_rate_radps == pytest.approx(0.2 / (2.0 * vehicle.drive.half_turning_m), rel=0.05)


def driven(follower: str, template: Template) -> Day:
    """A job of it from beginning to end, with all that it has told."""
    day = Day(crawler(), Scenario(seed=3), OnboardConfig(follower=follower), template=template)
    day.load()
    day.order("start")
    return day


# The kernels of a robot's computer take most of a minute to compile for four actuators, and those of the MPC another.
@pytest.mark.full
@pytest.mark.parametrize(
    ("follower", "template"), [("pure-pursuit", "line"), ("mpc", "study-square"), ("pure-pursuit", "study-square")]
)
def test_it_drives_and_its_recording_passes(tmp_path: Path, follower: str, template: str) -> None:
    day = driven(follower, LINE if template == "line" else load_template(template))
    day.drive(6000)
    assert day.emulator.onboard.state == TraversalStatus.DONE, day.emulator.onboard.status.reason
    path = write(tmp_path / "crawler.mcap", day.told)
    said = {topic.name: [] for topic in (topics.JOINT_STATES, topics.ACTUATOR_COMMAND, topics.REPORT)}
    for message in RecordingReader(path).messages():
        if (topic := topic_at(message.topic)) is not None and topic.name in said:
            said[topic.name].append(message.payload)
    joints, command = (
        decode(kind, said[topic.name][500])
        for kind, topic in ((JointState, topics.JOINT_STATES), (ActuatorCommand, topics.ACTUATOR_COMMAND))
    )
    assert joints.name == tuple(f"{name.replace('-', '_')}_wheel" for name in WHEELS)
    assert (len(joints.position), len(joints.velocity)) == (4, 4)
    assert (command.names, len(command.values)) == (WHEELS, 4)
    report = decode(TraversalReport, said[topics.REPORT.name][-1])
    assert report.success, report.verdict
    (one,) = check_recording(path, exact=True)
    assert one.passed, (one.problem, str(one.first))
    (alone,) = check_recording(path, exact=True, only="follower")
    assert alone.passed, (alone.problem, str(alone.first))
    told = CliRunner().invoke(app, ["check", str(path)])
    assert told.exit_code == 0, told.output


@pytest.mark.full
def test_a_fault_of_one_wheel_acts_upon_it_and_is_named() -> None:
    day = driven("pure-pursuit", LINE)
    day.drive(250)
    day.fault(kind="wheel-blocked", actuator="rear-left")
    day.drive(150)
    emulator = day.emulator
    assert emulator.world.drive.rate_radps[2] == 0.0
    assert emulator.onboard.state == TraversalStatus.PAUSED
    assert emulator.onboard.status.reason == "the rear-left wheel does not turn as commanded"
