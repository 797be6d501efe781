"""The sensors' errors: as large, as correlated and as late as the scenario says, and none without noise."""

import math
from copy import deepcopy

import numpy as np
import pytest

from tests.robot_sim.open_loop import AT_REST, REST, STILL, drive, fixes, lived
from touchline.onboard.interface import Command
from touchline.schemas.messages import GnssStatus
from touchline.schemas.scenario import (
    EncoderNoise,
    GnssNoise,
    Ground,
    ImuNoise,
    MagnetometerNoise,
    Obstruction,
    Scenario,
    Steel,
)
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.sensors.gnss_truth import white
from touchline.services.robot_sim.sensors.magnetometer_truth import FIELD_HORIZONTAL_T
from touchline.services.robot_sim.sensors.moment import Moment
from touchline.services.robot_sim.sensors.sampling import stand_by
from touchline.services.robot_sim.sensors.suite import Sensors
from touchline.services.robot_sim.world.world import TruePose, World

VEHICLE = Vehicle()
PUNCTUAL = {"latency_jitter_s": 0.0}


def frames(scenario, ticks, state=STILL, vehicle=VEHICLE):
    sensors = Sensors(vehicle, scenario)
    return [sensors.read(tick, state) for tick in range(1, ticks + 1)]


def punctual_fixes(scenario, ticks):
    """Of a standing robot whose fixes arrive 11 ticks after every tenth: only when one does is there a frame."""
    sensors, found = Sensors(VEHICLE, scenario), []
    first = Moment(STILL.array, AT_REST.no_effects.array, scenario.seed, 1)
    wait = stand_by.for_types_of((first, 1, sensors.sensing))
    sensors.read(1, STILL)
    for tick in range(11, ticks + 1, 10):
        wait(first._replace(tick=tick - 9), tick - 1, sensors.sensing)
        found += sensors.read(tick, STILL).gnss
    return found


def speeds(world):
    return world.state.speed_mps, world.state.side_speed_mps


def test_without_noise_everything_is_true():
    world = World(VEHICLE, Scenario(noise="none"))
    sensors = Sensors(VEHICLE, Scenario(noise="none"))
    world.place(TruePose(5.0, -3.0, 0.3))
    for tick in range(1, 200):
        heading, (speed, side) = world.pose.heading_rad, speeds(world)
        world.step(Command((8.0, 10.0), False, False), tick)
        frame = sensors.read(tick, world.state)
        assert frame.time_s == tick / 100
        assert frame.imu.gyro_z_radps == pytest.approx((world.pose.heading_rad - heading) / 0.01, abs=1e-12)
        (speed_now, side_now), turn = speeds(world), frame.imu.gyro_z_radps
        forward = (speed_now - speed) / 0.01 - 0.5 * (side_now + side) * turn
        assert frame.imu.accel_x_mps2 == pytest.approx(forward, abs=2e-3)
        leftward = (side_now - side) / 0.01 + 0.5 * (speed_now + speed) * turn
        assert frame.imu.accel_y_mps2 == pytest.approx(leftward, abs=2e-2)
        assert frame.imu.accel_z_mps2 == 9.80665
        magnetic_heading = math.pi / 2 - math.atan2(frame.mag.y_t, frame.mag.x_t)
        assert math.remainder(math.atan2(frame.mag.x_t, frame.mag.y_t) - world.pose.heading_rad, math.tau) == (
            pytest.approx(0.0, abs=1e-12)
        ), magnetic_heading
        assert frame.encoders == (world.state.angles_rad[0], world.state.angles_rad[1])
    assert frame.imu.accel_y_mps2 == pytest.approx(world.state.speed_mps * world.state.yaw_rate_radps, rel=1e-2)


def test_gnss_is_late_by_its_latency_and_true_at_its_stamp():
    vehicle = Vehicle(body={"gnss_antenna_x_m": 0.2, "gnss_antenna_y_m": -0.1})
    scenario = Scenario(noise="none")
    world, sensors = World(vehicle, scenario), Sensors(vehicle, scenario)
    antenna, arrivals = {}, []
    for tick in range(1, 400):
        world.step(Command((8.0, 10.0), False, False), tick)
        east, north, heading = world.pose
        antenna[tick] = (
            east + 0.2 * math.cos(heading) + 0.1 * math.sin(heading),
            north + 0.2 * math.sin(heading) - 0.1 * math.cos(heading),
        )
        for fix in sensors.read(tick, world.state).gnss:
            arrivals.append(tick)
            assert fix.stamp_s == (tick - 11) / 100
            assert (fix.east_m, fix.north_m) == pytest.approx(antenna[tick - 11], abs=1e-7)
            assert fix.fix == GnssStatus.FIXED
    assert arrivals == list(range(21, 400, 10))


@pytest.mark.parametrize("latency_s, ticks", [(0.0, 0), (0.104, 11), (0.25, 25)])
def test_latency_is_rounded_up_to_a_tick(latency_s, ticks):
    scenario = Scenario(gnss=GnssNoise(latency_s=latency_s, latency_jitter_s=0.0))
    arrivals = [frame.tick for frame in frames(scenario, 60) if frame.gnss]
    assert arrivals[0] == 10 + ticks


def test_jitter_delays_each_fix_a_little_and_only_that():
    late = [frame.tick - round(fix.stamp_s * 100) for frame in frames(Scenario(), 2000) for fix in frame.gnss]
    assert set(late) == {11, 12}
    assert np.mean(late) == pytest.approx(11.5, abs=0.1)
    steady = [fix for frame in frames(Scenario(gnss=GnssNoise(**PUNCTUAL)), 2000) for fix in frame.gnss]
    jittery = [fix for frame in frames(Scenario(), 2000) for fix in frame.gnss]
    assert jittery == steady[: len(jittery)]


@pytest.mark.parametrize("rate_hz", [1, 5, 20])
def test_the_receiver_keeps_its_rate(rate_hz):
    fixes = [fix for frame in frames(Scenario(gnss=GnssNoise(rate_hz=rate_hz)), 1020) for fix in frame.gnss]
    assert len(fixes) == pytest.approx(10 * rate_hz, abs=1)
    assert np.diff([fix.stamp_s for fix in fixes]) == pytest.approx(1 / rate_hz)


def test_white_gnss_noise_and_its_reported_variance():
    scenario = Scenario(gnss=GnssNoise(gauss_markov_1_m=0, gauss_markov_2_m=0, **PUNCTUAL))
    fixes = punctual_fixes(scenario, 20_000)
    east, north = np.array([(fix.east_m, fix.north_m) for fix in fixes]).T
    assert np.std(east) == pytest.approx(0.0007, rel=0.1)
    assert np.std(north) == pytest.approx(0.0007, rel=0.1)
    assert abs(np.corrcoef(east, north)[0, 1]) < 0.1
    assert abs(np.corrcoef(east[:-1], east[1:])[0, 1]) < 0.1
    assert fixes[0].variance_m2 == pytest.approx(0.0007**2 + 0.091 * 0.0137**2)


def test_gauss_markov_terms_are_stationary_and_as_slow_as_stated():
    scenario = Scenario(gnss=GnssNoise(white_m=0, gauss_markov_2_m=0, gauss_markov_1_tau_s=2.0, **PUNCTUAL))
    east = np.array([fix.east_m for fix in punctual_fixes(scenario, 100_000)])
    assert np.std(east) == pytest.approx(0.0043, rel=0.12)
    assert np.corrcoef(east[:-20], east[20:])[0, 1] == pytest.approx(math.exp(-1), abs=0.08)
    first = [lived(scenario.model_copy(update={"seed": seed}), 21).gnss[0].east_m for seed in range(300)]
    assert np.std(first) == pytest.approx(0.0043, rel=0.15)


def test_fixes_with_a_white_tail_err_as_the_published_ones_do():
    """68.27/95.45/99.73 % of the horizontal errors, wander included, are within 7/17/38 mm: here of 200,000."""
    noise, count = GnssNoise.white_tail(), 200_000
    slow_m = math.hypot(noise.gauss_markov_1_m, noise.gauss_markov_2_m)
    wander = np.random.default_rng(1).normal(0.0, slow_m, (count, 2))
    drawn = np.array([(white(3, tick, 0), white(3, tick, 1)) for tick in range(count)])
    quantiles = np.quantile(np.hypot(*(noise.white_m * drawn + wander).T), [0.6827, 0.9545, 0.9973])
    assert quantiles == pytest.approx([0.007, 0.017, 0.038], rel=0.03)
    assert drawn.std() == pytest.approx(1.0, rel=0.01)
    assert np.corrcoef(drawn.T)[0, 1] == pytest.approx(0.0, abs=0.04)
    assert np.corrcoef(np.abs(drawn.T))[0, 1] > 0.4, "a fix is as bad along both axes"


def test_the_whole_fixed_error_is_what_is_reported():
    errors, reported = [], set()
    for seed in range(400):
        (fix,) = lived(Scenario(seed=seed, gnss=GnssNoise(burst_share=0, **PUNCTUAL)), 21).gnss
        errors.append(fix.east_m)
        reported.add(fix.variance_m2)
    assert len(reported) == 1
    assert np.std(errors) == pytest.approx(math.sqrt(reported.pop()), rel=0.1)


def test_gyro_noise_and_turn_on_bias():
    still = Scenario(imu=ImuNoise(gyro_turn_on_bias_radps=0, gyro_bias_walk_radps_rts=0, warming_k=0))
    gyro = np.array([frame.imu.gyro_z_radps for frame in frames(still, 20_000)])
    assert np.std(gyro) == pytest.approx(math.radians(0.014) * 10, rel=0.03)
    assert np.mean(gyro) == pytest.approx(0.0, abs=1e-4)
    quiet = {"gyro_density_radps_rthz": 0.0, "gyro_bias_walk_radps_rts": 0.0}
    biases = [frames(Scenario(seed=s, imu=ImuNoise(**quiet)), 1)[0].imu.gyro_z_radps for s in range(500)]
    assert np.std(biases) == pytest.approx(math.radians(1.0), rel=0.1)


def test_bias_walk_grows_with_the_root_of_time():
    walk = {
        "warming_k": 0.0,
        "gyro_density_radps_rthz": 0.0,
        "gyro_turn_on_bias_radps": 0.0,
        "gyro_bias_walk_radps_rts": 0.01,
    }
    ends = [lived(Scenario(seed=s, imu=ImuNoise(**walk)), 400).imu.gyro_z_radps for s in range(200)]
    assert np.std(ends) == pytest.approx(0.01 * 2.0, rel=0.15)


def test_biases_drift_as_the_sensor_warms_up():
    quiet = {"gyro_density_radps_rthz": 0.0, "gyro_bias_walk_radps_rts": 0.0, "gyro_turn_on_bias_radps": 0.0}
    quiet |= {"accel_density_mps2_rthz": 0.0, "accel_turn_on_bias_mps2": 0.0, "accel_bias_walk_mps2_rts": 0.0}
    drifts = {"gyro_temperature_radps_per_k": 0.001, "accel_temperature_mps2_per_k": 0.002}
    imu = ImuNoise(**quiet, **drifts, warming_k=10.0, warming_tau_s=2.0)
    ends, half = [], []
    for seed in range(300):
        sensors = Sensors(VEHICLE, Scenario(seed=seed, imu=imu))
        for found, tick in ((half, 139), (ends, 5000)):  # τ·ln 2, and warm
            read = sensors.read(tick, STILL).imu
            found.append((read.gyro_z_radps, read.accel_x_mps2))
    assert np.std(ends, axis=0) == pytest.approx([0.01, 0.02], rel=0.12)
    assert np.divide(half, ends) == pytest.approx(0.5, abs=0.01)


def test_soft_iron_bends_the_heading_twice_a_turn():
    scenario = Scenario(magnetometer=MagnetometerNoise(white_rad=0, bias_rad=0, disturbance_rad=0))
    state, errors = deepcopy(STILL), []
    sensors = Sensors(VEHICLE, scenario)
    for tick in range(1, 181):
        state.heading_rad = tick * math.tau / 180
        mag = sensors.read(tick, state).mag
        errors.append(math.remainder(math.atan2(mag.x_t, mag.y_t) - state.heading_rad, math.tau))
    twice = np.abs(np.fft.rfft(errors)) / 90
    assert 0.001 < twice[2] < 0.08
    assert twice[1] < 0.1 * twice[2]


def test_steel_turns_the_field_towards_itself_and_falls_with_distance():
    quiet = Scenario(
        magnetometer=MagnetometerNoise(white_rad=0, bias_rad=0, disturbance_rad=0, soft_iron_relative=0),
        steel=(Steel(outline=((10.0, 0.0),), field_t=8e-6, reach_m=2.0),),
    )
    sensors, fields = Sensors(VEHICLE, quiet), []
    for tick, east in enumerate((9.99, 8.0, -1000.0), start=1):
        state = deepcopy(STILL)
        state.east_m = east
        fields.append(sensors.read(tick, state).mag.x_t)
    assert fields == pytest.approx([8e-6, 1e-6, 0.0], rel=0.02, abs=1e-12)


def test_on_a_slope_accelerometer_magnetometer_and_antenna_lean():
    scenario = Scenario(noise="none", ground=Ground(grade=0.1, uphill_rad=math.pi / 2))
    world = World(VEHICLE, scenario)
    world.place(TruePose(0.0, 0.0, math.pi / 2))  # nose uphill
    sensors = Sensors(VEHICLE, scenario)
    for tick in range(1, 40):
        world.step(Command((0.0, 0.0), False, False), tick)
        frame = sensors.read(tick, world.state)
        for fix in frame.gnss:
            assert fix.north_m == pytest.approx(-VEHICLE.body.gnss_antenna_z_m * math.sin(math.atan(0.1)), abs=1e-6)
            assert fix.east_m == pytest.approx(0.0, abs=1e-6)
    angle = math.atan(0.1)
    assert frame.imu.accel_x_mps2 == pytest.approx(9.80665 * math.sin(angle), rel=1e-9)
    assert frame.imu.accel_z_mps2 == pytest.approx(9.80665 * math.cos(angle), rel=1e-9)
    assert frame.mag.x_t == pytest.approx(17.2e-6 * math.cos(angle) - 47.6e-6 * math.sin(angle), rel=1e-9)
    assert frame.mag.z_t == pytest.approx(-17.2e-6 * math.sin(angle) - 47.6e-6 * math.cos(angle), rel=1e-9)


@pytest.mark.parametrize("heading_rad", [0.0, 1.0, 2.5, -2.0])
@pytest.mark.parametrize("uphill_rad", [0.0, 0.7, 4.0])
def test_on_a_slope_the_antenna_is_where_the_bodys_axes_put_it(heading_rad, uphill_rad):
    """The axes by cross products from the plane's normal, the lever along them."""
    lever, grade = (0.3, -0.2, 0.6), 0.15
    vehicle = Vehicle(body={"gnss_antenna_x_m": lever[0], "gnss_antenna_y_m": lever[1], "gnss_antenna_z_m": lever[2]})
    scenario = Scenario(noise="none", ground=Ground(grade=grade, uphill_rad=uphill_rad))
    world, sensors = World(vehicle, scenario), Sensors(vehicle, scenario)
    world.place(TruePose(10.0, -20.0, heading_rad))
    rise = np.array([math.cos(uphill_rad), math.sin(uphill_rad)]) * grade
    upright = np.array([-rise[0], -rise[1], 1.0]) / math.hypot(grade, 1.0)
    ahead = np.array([math.cos(heading_rad), math.sin(heading_rad), 0.0])
    ahead[2] = rise @ ahead[:2]
    ahead /= np.linalg.norm(ahead)
    antenna = np.column_stack((ahead, np.cross(upright, ahead), upright)) @ lever + (10.0, -20.0, rise @ (10.0, -20.0))
    reports, found = [], []
    for tick in range(1, 30):
        found += sensors.read(tick, world.state).gnss
        reports += sensors.gnss_reports
    assert (found[0].east_m, found[0].north_m) == pytest.approx(antenna[:2], abs=1e-7)
    assert reports[0].altitude_m - scenario.origin.altitude_m == pytest.approx(
        antenna[2], abs=1e-4
    )  # the earth is round


def test_magnetic_heading_is_off_by_about_three_degrees():
    errors = []
    for seed in range(300):
        mag = frames(Scenario(seed=seed), 1)[0].mag
        errors.append(math.atan2(mag.x_t, mag.y_t))
    noise = MagnetometerNoise()
    expected = math.sqrt(noise.white_rad**2 + noise.bias_rad**2 + noise.disturbance_rad**2)
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(expected, rel=0.12)
    assert math.radians(3.0) < expected < math.radians(4.0)


def test_hard_iron_turns_with_the_body():
    scenario = Scenario(magnetometer=MagnetometerNoise(white_rad=0, disturbance_rad=0, soft_iron_relative=0))
    east, west = deepcopy(STILL), deepcopy(STILL)
    west.heading_rad = math.pi
    forward, back = frames(scenario, 1, east)[0].mag, frames(scenario, 1, west)[0].mag
    assert forward.x_t == pytest.approx(back.x_t, abs=1e-18)
    assert (forward.y_t - back.y_t) / 2 == pytest.approx(FIELD_HORIZONTAL_T)


def test_encoders_count_whole_ticks_and_lose_no_fraction():
    vehicle = Vehicle(drive={"encoder_ticks_per_revolution": 100})
    quantum = math.tau / 100
    sensors, state = Sensors(vehicle, Scenario()), deepcopy(STILL)
    for tick in range(1, 2000):
        state.angles_rad[0] = tick * quantum / 7
        state.angles_rad[1] = -tick * quantum / 7
        left, right = sensors.read(tick, state).encoders
        assert left / quantum == pytest.approx(round(left / quantum), abs=1e-9)
        assert abs(left - state.angles_rad[0]) <= quantum
        assert abs(right - state.angles_rad[1]) <= quantum
    (exact,) = frames(Scenario(encoder=EncoderNoise(quantised=False)), 1, state)
    assert exact.encoders[0] == state.angles_rad[0]


def test_one_sensor_changes_no_other():
    base = frames(Scenario(), 300)
    other = frames(Scenario(magnetometer=MagnetometerNoise(white_rad=0.5), encoder=EncoderNoise(quantised=False)), 300)
    assert [frame.imu for frame in base] == [frame.imu for frame in other]
    assert [frame.gnss for frame in base] == [frame.gnss for frame in other]
    assert base[0].mag != other[0].mag


NO_ACCEL = {
    "accel_density_mps2_rthz": 0.0,
    "accel_turn_on_bias_mps2": 0.0,
    "accel_bias_walk_mps2_rts": 0.0,
    "accel_temperature_mps2_per_k": 0.0,
}


def ahead(seed, ticks, **figures):
    """Readings of the forward accelerometer of a robot at rest in these ticks with these errors only."""
    sensors = Sensors(VEHICLE, Scenario(seed=seed, imu=ImuNoise(**{**NO_ACCEL, **figures})))
    return [sensors.read(tick, STILL).imu.accel_x_mps2 for tick in ticks]


def test_the_accelerometer_errs_as_its_data_sheet_says():
    assert ahead(1, range(1, 50)) == [0.0] * 49
    white = ahead(1, range(1, 4001), accel_density_mps2_rthz=0.002)
    assert np.std(white) == pytest.approx(0.002 * math.sqrt(100.0), rel=0.05)
    biases = [ahead(seed, (1, 2), accel_turn_on_bias_mps2=0.1) for seed in range(300)]
    assert np.std([first for first, _ in biases]) == pytest.approx(0.1, rel=0.15)
    assert all(first == second for first, second in biases)
    walk = ImuNoise(**{**NO_ACCEL, "accel_bias_walk_mps2_rts": 0.01})
    walked = [lived(Scenario(seed=seed, imu=walk), 100).imu.accel_x_mps2 for seed in range(200)]
    assert np.std(walked) == pytest.approx(0.01 * math.sqrt(1.0), rel=0.2)


def test_the_magnetic_disturbance_wanders():
    figures = MagnetometerNoise(white_rad=0, bias_rad=0, soft_iron_relative=0, disturbance_tau_s=0.5)
    sensors = Sensors(VEHICLE, Scenario(magnetometer=figures))
    mag = [sensors.read(tick, STILL).mag for tick in range(1, 15_001)]
    heading = np.array([math.atan2(sample.x_t, sample.y_t) for sample in mag])
    assert np.std(heading) == pytest.approx(0.04, rel=0.15)
    assert np.corrcoef(heading[:-50], heading[50:])[0, 1] == pytest.approx(math.exp(-1), abs=0.1)


def test_heights_err_twice_as_much_as_positions_and_the_report_says_so():
    sensors = Sensors(VEHICLE, Scenario(gnss=GnssNoise(gauss_markov_1_m=0, gauss_markov_2_m=0)))
    reports = []
    for tick in range(1, 6001):
        sensors.read(tick, STILL)
        reports += sensors.gnss_reports
    assert np.std([report.altitude_m for report in reports]) == pytest.approx(2 * 0.0007, rel=0.1)
    for report in reports:
        assert report.variance_m2 == pytest.approx(0.0007**2 + 0.091 * 0.0137**2)
        assert report.vertical_variance_m2 == pytest.approx(4 * report.variance_m2)


def test_by_the_trees_errors_grow_as_the_receiver_admits():
    trees = Obstruction(outline=((0.001, -50), (50, -50), (50, 50), (0.001, 50)), margin_m=3.0, noise_factor=4.0)
    white = GnssNoise(gauss_markov_1_m=0, burst_share=0, rate_hz=20)
    run = fixes(drive(6000, sky=(trees,), gnss=white, command=REST))
    assert {fix.fix for fix in run} == {3}
    assert np.std([fix.east_m for fix in run]) == pytest.approx(4 * 0.0007, rel=0.1)
    assert math.sqrt(run[0].variance_m2) == pytest.approx(4 * 0.0007, rel=0.01)
