"""Figures of the sensors that are easily left out: the accelerometer's, the height's, the sky's."""

import math

import numpy as np
import pytest

from tests.robot_sim.open_loop import REST, STILL, drive, fixes, lived
from touchline.schemas.scenario import GnssNoise, ImuNoise, MagnetometerNoise, Obstruction, Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.sensors.suite import Sensors

VEHICLE = Vehicle()
NO_ACCEL = {
    "accel_density_mps2_rthz": 0.0,
    "accel_turn_on_bias_mps2": 0.0,
    "accel_bias_walk_mps2_rts": 0.0,
    "accel_temperature_mps2_per_k": 0.0,
}


def ahead(seed, ticks, **figures):
    """What the forward accelerometer of a robot at rest reads in these ticks with these errors only."""
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
    assert np.std([report.altitude_m for report in reports]) == pytest.approx(2 * 0.00471, rel=0.1)
    for report in reports:
        assert report.variance_m2 == pytest.approx(0.00471**2)
        assert report.vertical_variance_m2 == pytest.approx(4 * report.variance_m2)


def test_by_the_trees_errors_grow_as_the_receiver_admits():
    trees = Obstruction(outline=((0.001, -50), (50, -50), (50, 50), (0.001, 50)), margin_m=3.0, noise_factor=4.0)
    white = GnssNoise(gauss_markov_1_m=0, gauss_markov_2_m=0, rate_hz=20)
    run = fixes(drive(6000, sky=(trees,), gnss=white, command=REST))
    assert {fix.fix for fix in run} == {3}
    assert np.std([fix.east_m for fix in run]) == pytest.approx(4 * 0.00471, rel=0.1)
    assert math.sqrt(run[0].variance_m2) == pytest.approx(4 * 0.00471, rel=0.01)
