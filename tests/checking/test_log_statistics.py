"""Statistics of logs find what synthetic data was made with, and have no number for what a log does not tell."""

import math
from itertools import accumulate

import numpy as np
import pytest

from touchline.checking.reality import imu_statistics as imu
from touchline.checking.reality import log_statistics as s
from touchline.checking.reality import receiver_statistics as receiver
from touchline.checking.reality import track_statistics as track
from touchline.checking.reality.log_samples import LogSamples, stretches
from touchline.checking.reality.receiver_fit import fitted_receiver
from touchline.checking.reality.wander_theory import fitted_wander, noise_variance, wander_variance
from touchline.schemas.vehicles import Vehicle

VEHICLE = Vehicle()
RADIUS_M, TRACK_M = VEHICLE.drive.wheel_radius_m, VEHICLE.drive.track_width_m
LENGTHS = (1, 2, 5, 10, 20)


def gauss_markov(count, share, rng):
    """A process with standard deviation 1 that keeps a share of its value from step to step."""
    fresh = math.sqrt(1.0 - share * share) * rng.normal(size=count)
    fresh[0] = rng.normal()
    return np.array(list(accumulate(fresh, lambda before, new: share * before + new)))


def drive(seconds=400.0, rest_s=20.0, turn_radps=0.05):
    """Wheels of a robot that rests, then drives at 1 m/s in slow curves; its heading."""
    ticks = np.arange(1, round(seconds * 100) + 1)
    speed = np.clip((ticks / 100 - rest_s) / 2.0, 0.0, 1.0)
    turn = turn_radps * speed * np.sign(np.sin(ticks / 3000))
    wheels = np.cumsum(np.column_stack([speed - 0.5 * TRACK_M * turn, speed + 0.5 * TRACK_M * turn]), axis=0)
    return ticks / 100, wheels * (0.01 / RADIUS_M), np.cumsum(turn) * 0.01, speed * 0.01


def log_of(course_rad=0.0, white_m=0.0, stretch=1.0, seed=1, reported_m=0.01, **shape):
    """A log whose fixes follow a course beside the heading, with noise; 10 Hz."""
    time_s, wheels, heading, step = drive(**shape)
    rng = np.random.default_rng(seed)
    places = np.column_stack([np.cumsum(stretch * step * part(heading + course_rad)) for part in (np.cos, np.sin)])
    fixes = np.column_stack([time_s, places])[::10]
    fixes[:, 1:] += white_m * rng.normal(size=(len(fixes), 2))
    readings = np.full((len(time_s), 6), np.nan)
    return LogSamples(time_s, wheels, readings, fixes, reported_m, VEHICLE)


def matched(log):
    return track.matched(log.time_s, log.antenna_track, log.fixes)


def test_theory_of_wander_has_the_figures_of_the_emulated_mower():
    found = [0.02 * math.sqrt(wander_variance(float(length), 1.1)) for length in LENGTHS]
    assert found == pytest.approx([0.018, 0.039, 0.086, 0.143, 0.213], rel=0.06)


def test_wander_is_recovered_from_a_track():
    found = []
    for seed in range(2):
        course = 0.03 * gauss_markov(200_000, math.exp(-0.01 / 0.8), np.random.default_rng(seed))
        driven = matched(log_of(course, 0.002, seed=seed, seconds=2000.0))
        sigmas = {length: track.lateral_sigma_m(driven, float(length)) for length in LENGTHS}
        for length in (1, 2, 5):
            expected = 0.03**2 * wander_variance(float(length), 0.8) + noise_variance(float(length), 0.1, 0.002)
            assert sigmas[length] == pytest.approx(math.sqrt(expected), rel=0.2)
        found.append(fitted_wander(sigmas, 0.1, 0.002))
    assert np.mean([each.sigma_rad for each in found]) == pytest.approx(0.03, rel=0.1)
    assert np.mean([each.length_m for each in found]) == pytest.approx(0.8, rel=0.25)


def test_white_noise_is_what_fixes_scatter_by_and_looks_like_no_wander():
    log = log_of(white_m=0.004)
    found = s.log_statistics(log)
    assert found[s.SCATTER].value == pytest.approx(0.004, rel=0.1)
    sigmas = {length: found[key].value for length, key in s.LATERAL.items()}
    assert sigmas[2] == pytest.approx(math.sqrt(noise_variance(2.0, 0.1, 0.004)), rel=0.15)
    assert fitted_wander(sigmas, 0.1, 0.004).sigma_rad < 0.002
    assert found[s.JUMPS].value == 0.0


def test_slip_is_recovered_unless_noise_hides_it_or_the_wheels_are_the_fixes_own():
    slip = 0.03 * gauss_markov(40_000, math.exp(-0.01 / 2.0), np.random.default_rng(3))
    over_2m = np.convolve(slip, np.full(200, 1.0 / 200), "valid").std()
    found = s.log_statistics(log_of(white_m=0.002, stretch=1.0 - slip))[s.SLIP]
    assert found.value == pytest.approx(over_2m, rel=0.25)
    hidden, own = (s.log_statistics(log)[s.SLIP] for log in (log_of(white_m=0.02), log_of(0.03 * slip / 0.01)))
    assert hidden.value is None and "noise" in hidden.untold
    assert own.value is None and "wheels' distance is that of the fixes" in own.untold


def test_jumps_are_found_where_they_are():
    log = log_of(white_m=0.002)
    fixes = log.fixes.copy()
    for at_s, east, north in ((100.0, 0.1, 0.0), (200.0, -0.05, 0.15), (300.0, 0.05, 0.0)):
        fixes[fixes[:, 0] >= at_s, 1:] += east, north
    found = s.jumps_of(log._replace(fixes=fixes))
    assert found == pytest.approx(np.array([[100.0, 0.1, 0.0], [200.0, -0.05, 0.15]]), abs=0.02)


def standing(seconds, white_m, slow_m, slow_s, seed):
    rng, share = np.random.default_rng(seed), math.exp(-1.0 / slow_s)
    off = np.column_stack([slow_m * gauss_markov(seconds, share, rng) for _ in range(2)])
    return np.column_stack([np.arange(seconds), off + white_m * rng.normal(size=off.shape)])


def test_a_standing_receiver_is_recovered():
    found = []
    for seed in range(6):
        off = receiver.each_second(standing(6000, 0.0007, 0.0045, 100.0, seed))
        assert receiver.difference_m(off, 1.0) == pytest.approx(
            math.sqrt(2.0 * (0.0007**2 + 0.0045**2 * (1.0 - math.exp(-0.01)))), rel=0.1
        )
        assert receiver.autocorrelation(off, 60.0) == pytest.approx(math.exp(-0.6), abs=0.15)
        found.append(fitted_receiver({lag: receiver.difference_m(off, lag) for lag in receiver.LAGS_S}))
    assert np.mean(found, axis=0) == pytest.approx([0.0007, 0.0045, 100.0], rel=0.15)


def test_a_gap_is_no_difference():
    fixes = standing(600, 0.001, 0.0, 10.0, 1)
    off = receiver.each_second(fixes[(fixes[:, 0] < 100) | (fixes[:, 0] > 200)])
    assert np.isnan(off[100:200]).all() and np.isfinite(off[:100]).all()
    assert receiver.difference_m(off, 1.0) == pytest.approx(0.001 * math.sqrt(2.0), rel=0.1)


def test_noise_and_walk_of_a_gyro_are_recovered():
    rng, n = np.random.default_rng(2), 400_000
    walk, density = 3e-4, 5e-4
    bias = walk * np.cumsum(0.1 * rng.normal(size=n))
    gyro, rests = bias + density * 10.0 * rng.normal(size=n), [(at, at + 6000) for at in range(0, n, 20_000)]
    found = imu.noise_density(imu.second_means(gyro, rests))
    assert found == pytest.approx(density, rel=0.1)
    biases = imu.biases_at_rest(np.arange(n) / 100, gyro, rests)
    assert imu.bias_walk(biases, density) == pytest.approx(walk, rel=0.35)
    still = imu.biases_at_rest(np.arange(n) / 100, density * 10.0 * rng.normal(size=n), rests)
    assert imu.bias_walk(still, 1.1 * density) is None


def test_driving_adds_to_what_an_imu_reads_at_rest():
    rng, n = np.random.default_rng(4), 20_000
    drives = np.arange(n) >= n // 2
    values = 0.3 * rng.normal(size=n) + np.where(drives, 0.4 * rng.normal(size=n), 0.0) + np.sin(np.arange(n) / 2000)
    assert imu.added_by_driving(values, drives, ~drives) == pytest.approx(0.4, rel=0.05)


@pytest.mark.parametrize(("rate_hz", "found_hz"), [(30.0, 30.0), (12.5, 12.5), (100.0, 100.0)])
def test_the_rate_of_interpolated_readings_is_found(rate_hz, found_hz):
    time_s = np.arange(1, 5001) / 100
    read_s = np.arange(-0.004, 51.0, 1.0 / rate_hz)
    values = np.interp(time_s, read_s, np.random.default_rng(5).normal(size=len(read_s)))
    assert imu.native_rate_hz(values) == pytest.approx(found_hz, rel=0.06)


def test_sampling_keeps_the_turn_of_a_gyro_and_the_scatter_of_an_accelerometer():
    time_s, readings = np.arange(1, 20_001) / 100, np.random.default_rng(6).normal(size=(20_000, 6))
    found = imu.sampled(time_s, readings, 20.0)
    assert np.std(found[:, 2]) < 0.5 * np.std(found[:, 5])
    turns, kept = (np.cumsum(values[:, 2])[::1000] for values in (readings, found))
    assert kept == pytest.approx(turns, abs=6.0)
    assert imu.sampled(time_s, readings, 100.0) is readings


def test_what_a_log_does_not_tell_has_a_reason():
    moving = s.log_statistics(log_of(white_m=0.002, seconds=60.0))
    assert "rests for 12 s" in moving[s.SIGMA].untold or "s at most" in moving[s.SIGMA].untold
    assert "too short" in moving[s.LATERAL[20]].untold
    assert moving[s.ROLLING].untold == "it has no gyro about x and y"
    rest = s.log_statistics(log_of(white_m=0.002, rest_s=500.0))
    assert rest[s.LATERAL[1]].untold == rest[s.SLIP].untold == "it drives 0 m"
    assert rest[s.SIGMA].value == pytest.approx(0.002, rel=0.1)
    loose = s.log_statistics(log_of(white_m=0.5, reported_m=0.8))
    assert "no RTK" in loose[s.JUMPS].untold
    for found in (moving, rest, loose):
        assert list(found) == list(s.MEANINGS)
        assert all((each.value is None) == bool(each.untold) for each in found.values())


def test_rests_begin_and_end_half_a_second_inside():
    ((first, last),) = stretches(log_of().rests)
    assert first <= 50 and 1900 < last < 1960


def test_what_dead_reckoning_errs_by_over_a_gap_is_no_jump():
    log = log_of(stretch=1.05)  # the wheels are 5 % too large
    told = log._replace(fixes=log.fixes[(log.fixes[:, 0] % 10.0) < 7.0])
    assert s.log_statistics(told)[s.JUMPS].value == 0.0
    assert len(s.jumps_of(told)) == 0
    moved = told.fixes.copy()
    moved[1500:, 1] += 0.2
    assert len(s.jumps_of(told._replace(fixes=moved))) == 1
