"""The real robot errs as the scenario's truth says, and its computer is told nothing of it."""

import math
from pathlib import Path

import numpy as np
import pytest

from tests.robot_sim.open_loop import REST
from touchline.core.physical_constants import GRAVITY_MPS2
from touchline.onboard.interface import Command
from touchline.schemas.errors import SpecError
from touchline.schemas.scenario import GnssNoise, Ground, GroundWave, Multipath, Scenario
from touchline.schemas.spec import parse
from touchline.schemas.truth import Truth
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.shipped import CLAY_ROLLER
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.sensors.suite import Sensors
from touchline.services.robot_sim.true_vehicle import true_vehicle
from touchline.services.robot_sim.world.roughness import height_m
from touchline.services.robot_sim.world.world import TruePose, World

VEHICLE = Vehicle()
BEND = Command((9.0, 11.0), False, False)
AHEAD = Command((10.0, 10.0), False, False)
FAST = Command((20.0, 20.0), False, False)


def quiet(truth=None, **parts):
    return Scenario(noise="none", truth=Truth(**(truth or {})), **parts)


class OpenLoop:
    """World and sensors of the real robot, without its computer."""

    def __init__(self, scenario):
        real = true_vehicle(VEHICLE, scenario.truth)
        self.world, self.sensors, self.tick = World(real, scenario), Sensors(real, scenario), 0

    def run(self, ticks, command=BEND):
        """Frame and true pose of each tick."""
        rows = []
        for _ in range(ticks):
            self.tick += 1
            self.world.step(command, self.tick)
            rows.append((self.sensors.read(self.tick, self.world.state), self.world.pose))
        return rows


def fixes(rows):
    """(east, north, stamp) of every fix, and the true poses at its tick of measurement."""
    found = [(fix, tick - 11) for tick, (frame, _) in enumerate(rows) for fix in frame.gnss]
    return (
        np.array([(fix.east_m, fix.north_m, fix.stamp_s) for fix, _ in found]),
        np.array([rows[tick][1] for _, tick in found]),
    )


def test_a_vehicle_without_deviations_is_the_one_in_the_file():
    assert true_vehicle(VEHICLE, Truth()) is VEHICLE
    assert "truth" not in Scenario().model_dump_json()
    assert "truth" in quiet({"crab_rad": 0.01}).model_dump_json()


def test_deviations_are_added_to_the_file():
    truth = Truth(
        wheel_radius_relative=0.01,
        track_width_relative=-0.02,
        antenna_x_m=0.03,
        antenna_z_m=0.1,
        nozzle_y_m=0.01,
        mast_left_rad=math.radians(1.0),
    )
    real = true_vehicle(VEHICLE, truth)
    assert real.drive.wheel_radius_m == pytest.approx(0.101)
    assert real.drive.track_width_m == pytest.approx(0.98 * VEHICLE.drive.track_width_m)
    assert real.tool.point_m == pytest.approx((0.0, VEHICLE.tool.nozzle_y_m + 0.01))
    antenna = real.body.gnss_antenna_x_m, real.body.gnss_antenna_y_m, real.body.gnss_antenna_z_m
    assert antenna == pytest.approx((0.03, 0.7 * math.sin(math.radians(1.0)), 0.7), abs=2e-4)
    roller = true_vehicle(CLAY_ROLLER, Truth(wheel_radius_relative=0.01, track_width_relative=0.01))
    assert roller.drive.drum_radius_m == pytest.approx(1.01 * CLAY_ROLLER.drive.drum_radius_m)
    assert roller.drive.wheelbase_m == pytest.approx(1.01 * CLAY_ROLLER.drive.wheelbase_m)
    with pytest.raises(SpecError, match="the vehicle has no nozzle"):
        true_vehicle(CLAY_ROLLER, Truth(nozzle_x_m=0.01))
    with pytest.raises(SpecError, match="drift_east_m is of no use"):
        true_vehicle(CLAY_ROLLER, Truth(drift_east_m=0.01))


def test_the_computer_is_told_the_file():
    emulator = Emulator(VEHICLE, quiet({"wheel_radius_relative": 0.05, "antenna_x_m": 0.03}))
    assert emulator.vehicle is VEHICLE and emulator.setup.vehicle is VEHICLE
    assert emulator.onboard._estimator.ring.figures.antenna_x_m == 0.0
    assert emulator.real.body.gnss_antenna_x_m == pytest.approx(0.03)


def test_larger_wheels_go_farther_and_a_wider_track_turns_less():
    plain, large, wide = (
        OpenLoop(quiet(truth)).run(500)[-1][1]
        for truth in ({}, {"wheel_radius_relative": 0.02}, {"track_width_relative": 0.02})
    )
    assert large.heading_rad == pytest.approx(1.02 * plain.heading_rad, rel=2e-3)
    assert wide.heading_rad == pytest.approx(plain.heading_rad / 1.02, rel=2e-3)
    loaded = [OpenLoop(quiet({"tyre_load_relative": share})).run(300, AHEAD)[-1][1][0] for share in (0.0, -0.02)]
    assert loaded[1] == pytest.approx(0.99 * loaded[0], rel=1e-3), "full, it is half of the share off the mean"
    drifting = OpenLoop(quiet({"wheel_difference_relative": 0.01})).run(500, AHEAD)[-1][1]
    assert drifting.heading_rad == pytest.approx(0.01 * 5.0 / VEHICLE.drive.track_width_m, rel=0.05)


def test_tyres_grow_as_they_get_warm():
    world = OpenLoop(quiet({"tyre_warming_relative": 0.01})).world
    world.step(AHEAD, 60_000)
    assert world.drive.warm_relative == pytest.approx(1.0 + 0.01 * (1.0 - math.exp(-1.0)))


def test_the_gyro_reads_its_scale_and_its_axes():
    rows, plain = OpenLoop(quiet({"gyro_scale_relative": 0.01})).run(300), OpenLoop(quiet()).run(300)
    for (frame, _), (before, _) in zip(rows, plain, strict=True):
        assert frame.imu.gyro_z_radps == pytest.approx(1.01 * before.imu.gyro_z_radps, rel=1e-12)
    frame, rate = OpenLoop(quiet({"gyro_lean_x_rad": 0.02})).run(300)[-1][0], plain[-1][0].imu.gyro_z_radps
    assert frame.imu.gyro_x_radps == pytest.approx(-0.02 * rate)
    assert frame.imu.gyro_z_radps == pytest.approx((1.0 - 0.5 * 0.02**2) * rate)


@pytest.mark.parametrize(
    ("truth", "ahead", "left"),
    [
        ({"antenna_x_m": 0.03}, 0.03, 0.0),
        ({"antenna_y_m": -0.03}, 0.0, -0.03),
        ({"mast_ahead_rad": math.radians(1.0)}, 0.6 * math.sin(math.radians(1.0)), 0.0),
    ],
)
def test_fixes_move_by_the_lever(truth, ahead, left):
    found, poses = fixes(OpenLoop(quiet(truth)).run(300))
    cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    assert found[:, 0] == pytest.approx(poses[:, 0] + cos * ahead - sin * left, abs=1e-6)
    assert found[:, 1] == pytest.approx(poses[:, 1] + sin * ahead + cos * left, abs=1e-6)


def test_stamps_are_off_and_jitter():
    plain, _ = fixes(OpenLoop(quiet()).run(300))
    late, _ = fixes(OpenLoop(quiet({"stamp_offset_s": -0.03})).run(300))
    assert late[:, :2] == pytest.approx(plain[:, :2])
    assert late[:, 2] == pytest.approx(plain[:, 2] - 0.03)
    jitter = Scenario(truth=Truth(stamp_jitter_s=0.01))
    rough, _ = fixes(OpenLoop(jitter).run(4000, REST))
    steady, _ = fixes(OpenLoop(Scenario()).run(4000, REST))
    assert rough[:, :2] == pytest.approx(steady[:, :2])
    assert np.std(rough[:, 2] - steady[:, 2]) == pytest.approx(0.01, rel=0.12)


def test_base_and_hard_iron_are_as_given():
    found, poses = fixes(OpenLoop(quiet({"base_east_m": 0.02, "base_north_m": -0.01})).run(300))
    assert found[:, 0] - poses[:, 0] == pytest.approx(0.02, abs=1e-6)
    assert found[:, 1] - poses[:, 1] == pytest.approx(-0.01, abs=1e-6)
    iron, plain = (OpenLoop(quiet(truth)).run(3, REST)[-1][0].mag for truth in ({"hard_iron_y_t": 3e-7}, {}))
    assert (iron.x_t - plain.x_t, iron.y_t - plain.y_t) == pytest.approx((0.0, 3e-7), abs=1e-15)


def test_a_crab_moves_beside_its_heading():
    forward, back = (
        OpenLoop(quiet({"crab_rad": 0.02})).run(500, command)[-1][1]
        for command in (AHEAD, Command((-10.0, -10.0), False, False))
    )
    for east, north, heading in (forward, back):
        assert abs(heading) < 1e-4
        assert north / east == pytest.approx(math.tan(0.02), rel=3e-3)
    assert forward.north_m > 0.0 > back.north_m


def lateral_m(north, step_m, length_m):
    """Standard deviation of the distance from a line fitted over a length, that length later."""
    count = round(length_m / step_m)
    x = step_m * np.arange(-count, 1)
    weights = np.array([1.0, length_m]) @ np.linalg.pinv(np.vstack([np.ones_like(x), x]).T)
    starts = range(count, len(north) - count, max(count // 10, 1))
    return np.std([north[at + count] - weights @ north[at - count : at + 1] for at in starts])


def test_the_wander_is_that_of_a_mower():
    """17/42/83/135/225 mm on the log; the process has 18/39/86/143/213 within 15 %."""
    noisy = quiet().effective()
    scenario = noisy.model_copy(update={"noise": "default", "truth": Truth(wander_rad=0.02)})
    world = World(VEHICLE, scenario)
    for tick in range(200):
        world.step(FAST, tick)
    norths = []
    for tick in range(200, 240_200):
        world.step(FAST, tick)
        if tick % 5 == 0:
            norths.append(world.state.north_m)
    assert abs(world.state.heading_rad) < 1e-6
    step_m = 0.05 * world.state.speed_mps
    found = [lateral_m(np.array(norths), step_m, length_m) for length_m in (1.0, 2.0, 5.0, 10.0, 20.0)]
    assert found == pytest.approx([0.018, 0.039, 0.086, 0.143, 0.213], rel=0.15)


@pytest.mark.parametrize(("roughness", "degps"), [("B", 1.7), ("C", 3.4), ("D", 6.8)])
def test_rough_ground_shakes_as_its_class_says(roughness, degps):
    """Roll rates at 1 m/s by integration of the spectrum; the robot feels one field with all its sensors."""
    robot = OpenLoop(quiet(ground=Ground(roughness=roughness)))
    rows = robot.run(6000, AHEAD)[500:]
    gyro = np.degrees([(frame.imu.gyro_x_radps, frame.imu.gyro_y_radps) for frame, _ in rows])
    assert np.std(gyro[:, 0]) == pytest.approx(degps, rel=0.15)
    assert np.std(gyro[:, 1]) == pytest.approx(degps, rel=0.4)
    accel_z = np.array([frame.imu.accel_z_mps2 for frame, _ in rows]) - GRAVITY_MPS2
    assert abs(accel_z.mean()) < 0.02
    assert np.std(accel_z) == pytest.approx(0.143 * degps / 1.7, rel=0.3)
    found, poses = fixes(rows)
    antenna_m = np.std(found[:, 1] - poses[:, 1])
    assert antenna_m == pytest.approx(0.0033 * degps / 1.7, rel=0.4)


def test_rough_ground_is_the_same_on_each_pass_and_stands_still_with_the_robot():
    world = World(VEHICLE, quiet(ground=Ground(roughness="C")))
    leans = []
    for place in ((3.0, 4.0), (0.0, 0.0), (3.0, 4.0)):
        world.place(TruePose(*place, 0.5))
        leans.append((world.state.up_x, world.state.up_y, world.state.height_m))
    assert leans[0] == leans[2] != leans[1]
    world.step(REST, 1)
    state = world.state
    rates = state.mean_roll_rate_radps, state.mean_pitch_rate_radps, state.mean_accel_z_mps2
    assert rates == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)


def test_the_drive_vibrates_above_10_hz_in_proportion_to_the_speed():
    shaken = Scenario(truth=Truth(vibration_mps2=0.4))
    rows, plain = (OpenLoop(scenario).run(4000, AHEAD)[200:] for scenario in (shaken, Scenario()))
    felt = np.array([(row[0].imu.accel_x_mps2, row[0].imu.accel_y_mps2, row[0].imu.accel_z_mps2) for row in rows])
    felt -= [(row[0].imu.accel_x_mps2, row[0].imu.accel_y_mps2, row[0].imu.accel_z_mps2) for row in plain]
    assert np.std(felt, axis=0) == pytest.approx(0.4, rel=0.05)
    power = (np.abs(np.fft.rfft(felt[:3800], axis=0)) ** 2).mean(axis=1)
    hz = np.fft.rfftfreq(3800, 0.01)
    assert power[(hz > 0.1) & (hz < 5.0)].mean() < 0.1 * power[hz > 20.0].mean()
    still, before = (OpenLoop(scenario).run(50, REST)[-1][0].imu for scenario in (shaken, Scenario()))
    assert still == before


def test_patches_slip_by_place_and_alike_on_each_pass():
    robot, passes = OpenLoop(quiet({"patch_slip_relative": 0.05})), []
    robot.run(300, FAST)
    for _ in range(2):
        robot.world.place(TruePose(0.0, 0.0, 0.0))
        robot.run(100, FAST)
        passes.append([pose for _, pose in robot.run(500, FAST)])
    first, again = np.array(passes)[:, :, :2]
    apart = np.hypot(*(first[:, None] - again[None]).transpose(2, 0, 1)).min(axis=1)
    assert apart[10:-10].max() < 0.02
    slips = np.array([height_m(robot.world.figures.patches, 5.0 * k, 40.0) for k in range(4000)])
    assert np.std(slips) == pytest.approx(0.05, rel=0.1)
    distance = np.hypot(*np.diff(first, axis=0).T).sum()
    plain = [pose for _, pose in OpenLoop(quiet()).run(900, FAST)]
    assert abs(distance / (plain[-1].east_m - plain[-500].east_m) - 1.0) > 0.003


def test_the_robot_leans_on_crown_and_ruts():
    crown = GroundWave(rise_m=0.32, length_m=128.0, across_rad=math.pi / 2, crest_y_m=32.0)
    world = World(VEHICLE, quiet(ground=Ground(waves=(crown,))))
    for north, slope in ((32.0, 0.0), (0.0, 0.16 * 2.0 * math.pi / 128.0), (64.0, -0.16 * 2.0 * math.pi / 128.0)):
        world.place(TruePose(10.0, north, 0.0))
        assert world.state.up_y == pytest.approx(slope, abs=2e-4)
        assert world.state.up_x == pytest.approx(0.0, abs=1e-4)
    ruts = World(VEHICLE, quiet(ground=Ground(waves=(GroundWave(rise_m=0.02, length_m=1.6),))))
    heights = []
    for east in np.arange(0.0, 1.6, 0.1):
        ruts.place(TruePose(east, 5.0, math.pi / 2))
        heights.append(ruts.state.height_m)
    assert np.ptp(heights) == pytest.approx(0.02 * math.cos(2.0 * math.pi * 0.25 / 1.6), rel=0.02)


def test_rough_ground_may_be_between_two_classes():
    leans = []
    for ground in (Ground(roughness="B", roughness_factor=2.0), Ground(roughness="C")):
        world = World(VEHICLE, quiet(ground=ground))
        world.place(TruePose(3.0, 4.0, 0.5))
        leans.append(world.state.up_x)
    assert leans[0] == pytest.approx(leans[1])


def test_wind_moves_the_paint_and_not_the_robot():
    plain, blown = (World(VEHICLE, quiet(truth)) for truth in ({}, {"drift_east_m": 0.002, "drift_north_m": -0.001}))
    for world in (plain, blown):
        world.step(Command((10.0, 10.0), True, True), 1)
    assert blown.pose == plain.pose
    assert blown.trace[:, :2] - plain.trace[:, :2] == pytest.approx(np.tile((0.002, -0.001), (len(plain.trace), 1)))


def test_reality_is_the_file_among_the_examples():
    text = (Path(__file__).parents[2] / "examples" / "reality.json").read_text(encoding="utf-8")
    assert parse(Scenario, text, "reality.json") == Scenario.reality()


def bursting(**update):
    return Scenario(gnss=GnssNoise(**{"rate_hz": 20, "latency_s": 0.0, "latency_jitter_s": 0.0, **update}))


def fix_errors(scenario, ticks, speed_mps):
    """Errors of fixes of a robot that moves without going anywhere, read only in the ticks that have one."""
    sensors, state = Sensors(VEHICLE, scenario), World(VEHICLE, quiet()).state
    state.speed_mps = speed_mps
    fixes = (sensors.read(tick, state).gnss[0] for tick in range(5, ticks, 5))
    return np.array([(fix.east_m, fix.north_m) for fix in fixes])


def test_bursts_have_the_published_quantiles_while_the_antenna_moves_and_only_then():
    slow = {"gauss_markov_1_tau_s": 30.0}  # more independent samples of the slow term
    moving = np.hypot(*fix_errors(bursting(**slow), 400_000, 1.0).T)
    assert np.quantile(moving, [0.6827, 0.9545, 0.9973]) == pytest.approx([0.007, 0.017, 0.038], rel=0.1)
    shown = fix_errors(bursting(gauss_markov_1_m=0.0, white_m=0.0), 100_000, 1.0)
    on = shown[:, 0] != shown[0, 0]
    assert np.mean(on) == pytest.approx(0.091, rel=0.25)
    lengths = np.diff(np.flatnonzero(np.diff(np.concatenate(([0], on, [0])).astype(int))))[::2] / 20
    assert np.mean(lengths) == pytest.approx(3.0, rel=0.25)
    standing = fix_errors(bursting(gauss_markov_1_m=0.0), 20_000, 0.0)
    assert np.std(standing, axis=0) == pytest.approx([0.0007, 0.0007], rel=0.15)


def test_bursts_change_nothing_else():
    with_bursts, without = fix_errors(bursting(), 5000, 1.0), fix_errors(bursting(burst_share=0.0), 5000, 1.0)
    alike = np.all(with_bursts == without, axis=1)
    assert 0.5 < alike.mean() < 1.0


PLACE = Multipath(outline=((-50, -50), (50, -50), (50, 50), (-50, 50)))


def errors_at(places, seed=1, first_tick=0, multipath=PLACE):
    scenario = quiet(seed=seed, multipath=(multipath,), gnss=GnssNoise(latency_s=0.0, rate_hz=20))
    sensors, world = Sensors(VEHICLE, scenario), World(VEHICLE, quiet())
    found = []
    for number, place in enumerate(places):
        world.place(TruePose(*place, 0.0))
        fix = sensors.read(first_tick + 10 * (number + 1), world.state).gnss[0]
        found.append((fix.east_m - place[0], fix.north_m - place[1]))
    return np.array(found)


def test_multipath_is_a_map_that_drifts():
    grid = [(4.0 * i - 40.0, 4.0 * j - 40.0) for i in range(20) for j in range(20)]
    here, again, later = errors_at(grid), errors_at(grid, first_tick=3000), errors_at(grid, first_tick=240_000)
    assert np.std(here) == pytest.approx(0.02, rel=0.25)
    assert np.corrcoef(here.ravel(), again.ravel())[0, 1] > 0.99
    assert np.corrcoef(here.ravel(), later.ravel())[0, 1] < 0.7
    assert abs(np.corrcoef(here.ravel(), errors_at(grid, seed=2).ravel())[0, 1]) < 0.3
    beside = errors_at([(x + 3.0, y) for x, y in grid])
    assert np.corrcoef(here.ravel(), beside.ravel())[0, 1] == pytest.approx(math.exp(-0.5), abs=0.2)


def test_multipath_ends_with_its_place():
    small = PLACE.model_copy(update={"outline": ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))})
    inside, half, outside = errors_at([(1.0, 0.5), (2.5, 0.5), (4.5, 0.5)], multipath=small)
    assert outside == pytest.approx((0.0, 0.0), abs=1e-6) != inside
    assert np.hypot(*half) > 0.0
