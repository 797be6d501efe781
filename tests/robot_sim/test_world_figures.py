"""Figures of the world that are easily left out: surfaces, discs, casters, supplies, and slopes across the way."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from tests.robot_sim.open_loop import drive as open_loop
from tests.robot_sim.open_loop import fault
from touchline.onboard.interface import Command
from touchline.schemas.scenario import DriveNoise, Ground, Scenario
from touchline.schemas.vehicles import Motor, Vehicle
from touchline.services.robot_sim.world.battery import FULL_V
from touchline.services.robot_sim.world.constants import SURFACES
from touchline.services.robot_sim.world.world import TruePose, World

VEHICLE = Vehicle()
GRAVITY = 9.80665
AHEAD = Command((10.0, 10.0), False, False)
STAND = Command((0.0, 0.0), False, False)


def level(**ground):
    return Scenario(noise="none", ground=Ground(**ground))


def drive(world, command, ticks, effects=None):
    for tick in range(1, ticks + 1):
        world.step(command, tick, effects)
    return world


def test_the_surfaces_are_those_of_the_documentation():
    text = Path(__file__).parents[2].joinpath("docs", "explanation", "robot-sim.md").read_text()
    row = r"\| `([a-z-]+)` \| ([\d.]+) \| ([\d.]+), ([\d.]+) \| ([\d.]+) \| ([\d.]+) \|"
    told = {name: tuple(map(float, figures)) for name, *figures in re.findall(row, text)}
    assert told == {name: tuple(surface) for name, surface in SURFACES.items()}


@pytest.mark.parametrize(
    ("surface", "slip"), [("grass", 0.00504), ("wet-grass", 0.01239), ("artificial-turf", 0.00228)]
)
def test_on_every_surface_a_wheel_slips_as_far_as_its_rolling_resistance_asks(surface, slip):
    """Share f / (C · √(1 − (f/μ)²)), f = rolling / 0.8: the driven wheels bear 80 % of the load and push all of it."""
    world = drive(World(VEHICLE, level(surface=surface)), AHEAD, 500)
    assert 1.0 - world.state.speed_mps / (world.drive.rate_radps[0] * 0.1) == pytest.approx(slip, rel=0.01)


@pytest.mark.parametrize(("surface", "across"), [("grass", 20.0), ("wet-grass", 12.0), ("artificial-turf", 26.0)])
def test_on_every_surface_a_side_slope_is_held_by_its_stiffness_across(surface, across):
    """Weight down the slope is grade · m · g, the wheels' load 0.8 · m · g, its casters' share held by them, too."""
    state = drive(World(VEHICLE, level(surface=surface, grade=0.05, uphill_rad=math.pi / 2)), AHEAD, 500).state
    assert -state.side_speed_mps / state.speed_mps == pytest.approx(0.05 / (0.8 * across), rel=0.1)


def test_a_way_across_the_slope_is_as_long_on_the_map_as_on_level_ground():
    for heading, uphill in ((0.0, math.pi / 2), (0.8, 0.8 - math.pi / 2)):
        flat, slope = World(VEHICLE, level()), World(VEHICLE, level(grade=0.15, uphill_rad=uphill))
        lengths = []
        for world in (flat, slope):
            world.place(TruePose(0.0, 0.0, heading))
            drive(world, AHEAD, 500)
            lengths.append(world.pose.east_m * math.cos(heading) + world.pose.north_m * math.sin(heading))
        assert lengths[1] == pytest.approx(lengths[0], rel=2e-3)


@pytest.mark.parametrize(("heading_rad", "uphill_rad"), [(0.0, 0.0), (0.0, math.pi / 2), (1.0, 2.8), (-2.0, 0.4)])
def test_on_a_slope_the_map_sees_less_of_the_nozzles_lever(heading_rad, uphill_rad):
    """The lever lies in the ground's plane: along the robot's way, and at a right angle to that in the plane."""
    vehicle, grade = Vehicle(tool={"nozzle_x_m": 0.3, "nozzle_y_m": -0.4}), 0.15
    world = World(vehicle, level(grade=grade, uphill_rad=uphill_rad))
    world.place(TruePose(3.0, 4.0, heading_rad))
    drive(world, STAND, 1)
    rise = grade * np.array([math.cos(uphill_rad), math.sin(uphill_rad)])
    ahead = np.array([math.cos(heading_rad), math.sin(heading_rad), 0.0])
    ahead[2] = rise @ ahead[:2]
    left = np.cross((-rise[0], -rise[1], 1.0), ahead)
    nozzle = 0.3 * ahead / np.linalg.norm(ahead) - 0.4 * left / np.linalg.norm(left)
    assert world.trace[-1, :2] - (3.0, 4.0) == pytest.approx(nozzle[:2], abs=1e-12)
    assert nozzle[2] == pytest.approx(rise @ nozzle[:2]), "it is on the ground"


def test_discs_are_lifted_as_slowly_as_they_are_lowered():
    world = drive(World(VEHICLE, level()), Command((0.0, 0.0), False, True), 49)
    assert world.state.disc_down == 0.0
    drive(world, Command((0.0, 0.0), False, True), 1)
    assert world.state.disc_down == 1.0
    drive(world, STAND, 49)
    assert world.state.disc_down == 1.0
    drive(world, STAND, 1)
    assert world.state.disc_down == 0.0


@pytest.mark.parametrize("angle_rad", [1.0, -2.0])
def test_casters_come_round_within_their_trail(angle_rad):
    """A tractrix: dθ/ds = −sin θ / trail, so tan(θ/2) falls by e on each trail's length."""
    world = drive(World(VEHICLE, level()), AHEAD, 300)
    world.drive.caster_x, world.drive.caster_y = math.cos(angle_rad), math.sin(angle_rad)
    for _ in range(4):
        before, at = math.atan2(world.drive.caster_y, world.drive.caster_x), world.pose.east_m
        drive(world, AHEAD, 1)
        after, way = math.atan2(world.drive.caster_y, world.drive.caster_x), world.pose.east_m - at
        shrunk = math.exp(-way / VEHICLE.drive.caster_trail_m)
        assert math.tan(after / 2) == pytest.approx(math.tan(before / 2) * shrunk, rel=0.03)


@pytest.mark.parametrize("paint_speed_mps", [0.5, 1.5])
def test_a_line_takes_the_same_paint_whatever_speed_it_is_painted_at(paint_speed_mps):
    vehicle = Vehicle(tool={"paint_speed_mps": paint_speed_mps})
    world = drive(World(vehicle, level()), Command((0.0, 0.0), True, False), 10)
    before = world.state.tank_l
    drive(world, Command((0.0, 0.0), True, False), 100)
    assert before - world.state.tank_l == pytest.approx(vehicle.tool.paint_l_per_m * paint_speed_mps, rel=1e-9)


def test_paint_that_a_fault_keeps_back_is_still_carried():
    run = open_loop(500, fault("tank-empty", start_s=1.0), noise="none", command=AHEAD)
    plain = open_loop(500, noise="none", command=AHEAD)
    assert run[-1].frame.tank_l == 0.0
    assert run[-1].state.power_w == plain[-1].state.power_w > 0.0


def test_supplies_that_faults_keep_back_come_back_less_what_was_used():
    worse = [fault("tank-empty", litres=2.0, start_s=1.0, duration_s=1.0)]
    worse.append(fault("battery-low", fraction=0.3, start_s=1.0, duration_s=1.0))
    worse.append(fault("tank-empty", litres=1.0, start_s=1.5, duration_s=0.2))
    command = Command((10.0, 10.0), True, False)
    run, plain = open_loop(300, *worse, noise="none", command=command), open_loop(300, noise="none", command=command)
    assert run[100].frame.tank_l <= 2.0 and run[160].frame.tank_l <= 1.0
    assert run[199].frame.tank_l <= 1.0, "not given back as long as there is less than was asked for"
    assert run[-1].frame.tank_l == pytest.approx(plain[-1].frame.tank_l, rel=1e-12)
    assert run[-1].frame.battery_fraction == pytest.approx(plain[-1].frame.battery_fraction, abs=2e-5)


def test_braking_and_rolling_downhill_give_nothing_back_to_the_battery():
    world = drive(World(VEHICLE, level(grade=0.15, uphill_rad=math.pi)), AHEAD, 300)
    charge = [world.state.battery_wh]
    for _ in range(200):
        drive(world, Command((2.0, 2.0), False, False), 1)
        charge.append(world.state.battery_wh)
        assert world.state.power_w >= VEHICLE.body.idle_power_w - 1e-9
    used_wh = -np.diff(charge)
    assert (used_wh >= VEHICLE.body.idle_power_w * 0.01 / 3600.0 * (1.0 - 1e-6)).all()


@pytest.mark.parametrize(("wheel", "turned"), [("left", 1.0), ("right", -1.0)])
def test_one_weak_motor_leaves_the_other_as_it_is_and_turns_the_robot_to_its_side(wheel, turned):
    weak = fault("motor-weak", actuator=wheel, share=0.0, start_s=1.0)
    run = open_loop(150, weak, noise="none", command=AHEAD)
    other = 1 if wheel == "left" else 0
    assert run[-1].drive.rate_radps[other] == pytest.approx(10.0, abs=0.3)
    assert turned * run[-1].state.heading_rad > 0.05


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
    world = World(VEHICLE, level())
    world.drive.caster_x, world.drive.caster_y = math.cos(angle_rad), math.sin(angle_rad)
    return drive(world, Command((5.0, 5.0), False, False), 30).pose.heading_rad


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
    world = World(VEHICLE, level())
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
    world = World(VEHICLE.changed(drive={"motor": motor}), level())
    full = drive(world, Command((20.0, 20.0), False, False), 500).drive.rate_radps[0]
    assert 0.8 * idle_radps < full < idle_radps
    world.state.battery_wh *= 0.2
    assert drive(world, Command((20.0, 20.0), False, False), 500).drive.rate_radps[0] < 0.9 * full


def test_the_body_turns_as_fast_as_torque_and_inertia_say():
    motor = Motor(max_current_a=8.0)
    slow = VEHICLE.changed(drive={"motor": motor}, body={"radius_of_gyration_m": 1.5})
    world = drive(World(slow, level()), Command((-20.0, 20.0), False, False), 10)
    before = world.state.yaw_rate_radps
    drive(world, Command((-20.0, 20.0), False, False), 10)
    torque = 8.0 * motor.constant_nm_per_a * motor.gear_ratio * motor.gear_efficiency - motor.friction_nm
    weight, grass = slow.tool.mass_full_kg * GRAVITY, SURFACES["grass"]
    held = grass.rolling * weight * (1.0 - slow.drive.caster_load_share) * slow.drive.half_track_m
    turning = 2.0 * slow.drive.half_track_m / slow.drive.wheel_radius_m * torque - held
    inertia = (
        slow.tool.mass_full_kg * 1.5**2
        + 2.0 * motor.inertia_kgm2 * (slow.drive.half_track_m / slow.drive.wheel_radius_m) ** 2
    )
    assert (world.state.yaw_rate_radps - before) / 0.1 == pytest.approx(turning / inertia, rel=0.15)
