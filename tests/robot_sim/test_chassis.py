"""The robot's body, tyres, casters and motors, one at a time and by known answers."""

import math

import numpy as np
import pytest

from touchline.onboard.interface import Command
from touchline.schemas.scenario import DriveNoise, Ground, Scenario
from touchline.schemas.vehicles import Motor, Vehicle
from touchline.services.robot_sim.world.battery import FULL_V
from touchline.services.robot_sim.world.constants import SURFACES
from touchline.services.robot_sim.world.world import World

QUIET = Scenario(noise="none")
VEHICLE = Vehicle()
GRAVITY = 9.80665


def drive(world, left, right, ticks):
    for tick in range(1, ticks + 1):
        world.step(Command((left, right), False, False), tick)
    return world


def test_every_robot_has_a_track_and_two_wheels_of_its_own():
    nominal = [VEHICLE.drive.track_width_m, VEHICLE.drive.wheel_radius_m, VEHICLE.drive.wheel_radius_m]
    drives = [World(VEHICLE, Scenario(seed=seed)).figures.drive for seed in range(400)]
    errors = np.array([(drive.track_m, *drive.radius_m) for drive in drives]) / nominal - 1.0
    assert errors.std(axis=0) == pytest.approx([0.002, 0.003, 0.003], rel=0.15)
    assert np.abs(np.corrcoef(errors.T)[np.triu_indices(3, 1)]).max() < 0.15


def test_the_wheels_slip_each_on_its_own_and_more_on_wet_grass():
    spread = {}
    for surface in ("artificial-turf", "grass", "wet-grass"):
        world = World(VEHICLE, Scenario(drive=DriveNoise(slip_tau_s=0.05), ground=Ground(surface=surface)))
        slips = []
        for tick in range(1, 4001):
            world.step(Command((0.0, 0.0), False, False), tick)
            slips.append(world.drive.slip.copy())
        spread[surface] = np.std(slips)
        assert abs(np.corrcoef(np.transpose(slips))[0, 1]) < 0.1
    assert spread["artificial-turf"] < 0.6 * spread["grass"]
    assert spread["wet-grass"] > 1.3 * spread["grass"]


def after_a_turned_caster(angle_rad):
    world = World(VEHICLE, QUIET)
    world.drive.caster_x, world.drive.caster_y = math.cos(angle_rad), math.sin(angle_rad)
    return drive(world, 5.0, 5.0, 30).pose.heading_rad


def test_casters_that_point_aside_drag_the_robot_round():
    assert abs(after_a_turned_caster(0.0)) < 1e-12
    turned = after_a_turned_caster(1.0)
    # Their resistance pulls against the way they roll, at the place where they are.
    assert math.copysign(1.0, turned) == -math.copysign(1.0, VEHICLE.drive.caster_x_m)
    assert abs(turned) > 1e-4
    assert after_a_turned_caster(-1.0) == pytest.approx(-turned, rel=1e-6)


@pytest.mark.parametrize("spinning", [1.0, 3.0])
def test_a_tyre_has_one_grip_for_both_directions(spinning):
    """Sliding sideways they hold with no more than their grip, and with far less of it when they spin as well."""
    world = World(VEHICLE, QUIET)
    world.state.speed_mps = world.state.side_speed_mps = 1.0
    world.drive.rate_radps[:] = spinning / VEHICLE.drive.wheel_radius_m
    world.step(Command((10.0, 10.0), False, False), 1)
    held = (1.0 - world.state.side_speed_mps) / 0.01
    most = SURFACES["grass"].grip * GRAVITY * (1.0 - VEHICLE.drive.caster_load_share)
    casters = SURFACES["grass"].rolling * GRAVITY * VEHICLE.drive.caster_load_share
    assert held < most * (1.0 if spinning == 1.0 else 0.65) + casters
    assert held > 0.3 * most


def test_the_batterys_voltage_limits_the_speed():
    motor = Motor(gear_ratio=40.0)
    idle_radps = FULL_V / (motor.constant_nm_per_a * motor.gear_ratio)
    assert idle_radps < 0.8 * VEHICLE.drive.max_wheel_speed_radps
    world = World(VEHICLE.changed(drive={"motor": motor}), QUIET)
    full = drive(world, 20.0, 20.0, 500).drive.rate_radps[0]
    assert 0.8 * idle_radps < full < idle_radps
    world.state.battery_wh *= 0.2
    assert drive(world, 20.0, 20.0, 500).drive.rate_radps[0] < 0.9 * full


def test_the_body_turns_as_fast_as_torque_and_inertia_say():
    motor = Motor(max_current_a=8.0)
    slow = VEHICLE.changed(drive={"motor": motor}, body={"radius_of_gyration_m": 1.5})
    world = drive(World(slow, QUIET), -20.0, 20.0, 10)
    before = world.state.yaw_rate_radps
    drive(world, -20.0, 20.0, 10)
    torque = 8.0 * motor.constant_nm_per_a * motor.gear_ratio * motor.gear_efficiency - motor.friction_nm
    weight, grass = slow.tool.mass_full_kg * GRAVITY, SURFACES["grass"]
    held = grass.rolling * weight * (1.0 - slow.drive.caster_load_share) * slow.drive.half_track_m
    turning = 2.0 * slow.drive.half_track_m / slow.drive.wheel_radius_m * torque - held
    inertia = (
        slow.tool.mass_full_kg * 1.5**2
        + 2.0 * motor.inertia_kgm2 * (slow.drive.half_track_m / slow.drive.wheel_radius_m) ** 2
    )
    assert (world.state.yaw_rate_radps - before) / 0.1 == pytest.approx(turning / inertia, rel=0.15)
