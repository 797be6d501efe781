"""A drive that is registered moves the robot in its world and is sensed, and no file but its own knows it."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from tests.planner.drum_drive import DrumDrive
from tests.robot_sim.crawler import registered
from touchline.onboard.interface import Command
from touchline.schemas.cdr import decode
from touchline.schemas.errors import SpecError
from touchline.schemas.faults import parse_fault
from touchline.schemas.messages import ActuatorCommand, JointState
from touchline.schemas.plugins import DRIVES
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import NoTool, Vehicle
from touchline.services.robot_sim import tick_log
from touchline.services.robot_sim.fault_timeline import FaultTimeline
from touchline.services.robot_sim.samples import Samples
from touchline.services.robot_sim.sensors.suite import Sensors
from touchline.services.robot_sim.world import body
from touchline.services.robot_sim.world.world import World, held

# What is compiled for it is not kept on disk; a drive of four actuators (tests/plugins) shows the same more often.
pytestmark = [pytest.mark.full, pytest.mark.xdist_group("drum")]
DRIVE = DrumDrive(max_steering_rate_radps=1e3)
QUIET = Scenario(noise="none")


@pytest.fixture(autouse=True)
def drum() -> Iterator[None]:
    with registered():
        yield


def driven(vehicle: Vehicle, command: tuple[float, float], ticks: int, effects=None) -> World:
    world = World(vehicle, QUIET)
    for tick in range(1, ticks + 1):
        world.step(Command(command, False, False), tick, effects)
    return world


@pytest.mark.parametrize(("drum_radps", "steering_rad"), [(2.0, 0.3), (-2.0, 0.3), (1.0, -0.5), (3.0, 0.0)])
def test_it_drives_the_circle_that_its_steering_means(drum_radps: float, steering_rad: float) -> None:
    vehicle = Vehicle(drive=DRIVE)
    world = driven(vehicle, (drum_radps, steering_rad), 400)
    speed, time_s = drum_radps * DRIVE.drum_radius_m, 4.0
    curvature = -math.tan(steering_rad) / DRIVE.wheelbase_m
    turned = speed * curvature * time_s
    pose = world.pose
    assert pose.heading_rad == pytest.approx(turned, rel=1e-3, abs=1e-12)
    along = speed * time_s if not curvature else math.sin(turned) / curvature
    aside = 0.0 if not curvature else (1.0 - math.cos(turned)) / curvature
    assert (pose.east_m, pose.north_m) == pytest.approx((along, aside), abs=2e-3)
    assert world.state.mean_yaw_rate_radps == pytest.approx(speed * curvature)
    assert world.state.mean_accel_y_mps2 == pytest.approx(speed * speed * curvature, abs=1e-9)


def test_its_encoders_count_what_it_turned() -> None:
    vehicle = Vehicle(drive=DRIVE)
    world, sensors = World(vehicle, QUIET), Sensors(vehicle, QUIET)
    for tick in range(1, 201):
        world.step(Command((2.0, 0.25), False, False), tick)
        drum, steering = sensors.read(tick, world.state).encoders
    assert drum == pytest.approx(2.0 * 2.0, abs=2e-3)
    assert steering == pytest.approx(0.25, abs=2e-4)
    quanta = [each.encoder_rad for each in vehicle.drive.actuators]
    counts = np.array([drum, steering]) / quanta
    assert counts == pytest.approx(np.round(counts), abs=1e-6)


def test_it_stands_where_it_is_put() -> None:
    world = driven(Vehicle(drive=DRIVE), (2.0, 0.3), 100)
    angles = world.state.angles_rad[:2].copy()
    world.place(world.pose._replace(east_m=5.0))
    before = world.pose
    world.step(Command((0.0, 0.3), False, False), 101)
    assert world.pose == before
    assert world.state.angles_rad[:2].tolist() == angles.tolist()


@pytest.mark.parametrize(
    ("fault", "speed_mps", "steering_rad"),
    [
        ('{"kind": "wheel-blocked", "actuator": "drum"}', 0.0, 0.25),
        ('{"kind": "wheel-blocked", "actuator": "steering"}', 0.8, 0.0),
        ('{"kind": "wheel-slip", "actuator": "drum", "share": 0.25}', 0.6, 0.25),
        ('{"kind": "motor-weak", "actuator": "drum", "share": 0.5}', 0.4, 0.25),
    ],
)
def test_faults_are_of_its_actuators(fault: str, speed_mps: float, steering_rad: float) -> None:
    timeline = FaultTimeline([parse_fault(fault)], DRIVE)
    timeline.step(1)
    world = driven(Vehicle(drive=DRIVE), (2.0, 0.25), 100, timeline.effects)
    assert world.state.speed_mps == pytest.approx(speed_mps)
    assert world.state.angles_rad[1] == pytest.approx(steering_rad)
    with pytest.raises(SpecError, match=r"is 'left'; give 'drum', 'steering' or 'all'"):
        FaultTimeline([parse_fault('{"kind": "wheel-blocked"}')], DRIVE)


def test_its_actuators_are_named_on_the_wire() -> None:
    rows = np.zeros((1, tick_log.columns(2)))
    tick_log.note(
        rows[0],
        3,
        driven(Vehicle(), (0.0, 0.0), 1).state.array,
        np.zeros(11),
        held(Command((1.5, -0.25), False, False)),
    )
    samples = Samples(Vehicle(drive=DRIVE), QUIET, np.zeros((8, 11)), 1)
    said = {series.topic.name: payload for series in samples.series(rows, ()) for payload in series.payloads.each()}
    command = decode(ActuatorCommand, said["cmd/actuators"])
    assert (command.names, command.values.tolist()) == (("drum", "steering"), [1.5, -0.25])
    assert decode(JointState, said["joint_states"]).name == ("drum", "fork")


def test_a_vehicle_without_a_tool_paints_nothing_whatever_is_commanded() -> None:
    vehicle = Vehicle(tool=NoTool(point_x_m=0.3))
    world = World(vehicle, QUIET)
    assert world.supplies == (0.0, vehicle.body.battery_wh, 0.0, 0.0)
    for tick in range(1, 101):
        world.step(Command((10.0, 10.0), True, True), tick)
        assert not world.trace[:, body.TRACE_SPRAYING].any()
    assert (world.state.tank_l, world.state.flow_lps, world.state.valve, world.state.disc) == (0.0,) * 4
    assert world.trace[-1, body.TRACE_EAST] == pytest.approx(world.pose.east_m + 0.3, abs=1e-6)


def test_a_kind_without_a_part_in_the_world_is_told_and_what_it_lacks() -> None:
    parts = DRIVES.find("drum")
    DRIVES.forget("drum")
    DRIVES.register("drum", "a driven drum and a steered wheel", replace(parts, world=None))
    with pytest.raises(
        SpecError, match=r"drive.kind is 'drum', which has nothing for the world; .*\(differential, rear-steered\)"
    ):
        World(Vehicle(drive=DRIVE), QUIET)
