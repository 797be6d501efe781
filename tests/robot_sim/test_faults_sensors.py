"""Faults of messages and of the other sensors: what the computer is told, and that it ends."""

import math

import numpy as np
import pytest

from tests.robot_sim.open_loop import ages, drive, fault, fixes, second
from touchline.schemas.scenario import GnssNoise


@pytest.mark.parametrize("sensor, name", [("imu", "imu"), ("magnetometer", "mag"), ("encoder", "encoder")])
def test_late_samples_are_old_and_unchanged(sensor, name):
    run, plain = drive(300, second("messages-late", sensor=sensor, delay_s=0.05)), drive(300)
    seen = ages(run, name)
    assert seen[:100] == [0] * 100
    assert seen[100:105] == [1, 2, 3, 4, 5]
    assert seen[105:200] == [5] * 95
    assert seen[-90:] == [0] * 90
    field = {"imu": "imu", "mag": "mag", "encoder": "encoders"}[name]
    for tick, age in enumerate(seen):
        assert getattr(run[tick].frame, field) == getattr(plain[tick - age].frame, field)


def test_lost_samples_leave_the_last_one():
    run = drive(300, second("messages-lost", sensor="encoder"))
    assert ages(run, "encoder")[100:200] == list(range(1, 101))
    assert ages(run, "encoder")[200] == 0
    half = ages(drive(300, second("messages-lost", sensor="imu", share=0.5)), "imu")
    assert 25 < sum(age > 0 for age in half[100:200]) < 75
    assert not any(half[:100]) and not any(half[200:])


def test_samples_out_of_order_are_now_older_now_newer():
    run = ages(drive(300, second("messages-reordered", sensor="imu", spread_s=0.05)), "imu")
    stamps = np.arange(300) - run
    assert (np.diff(stamps[100:205]) < 0).any()
    assert max(run[:100]) == 0 and max(run[210:]) == 0
    assert max(run) <= 11


def test_a_sample_that_comes_again_replaces_newer_ones():
    run = ages(drive(300, second("messages-duplicated", sensor="imu", after_s=0.03, share=0.2)), "imu")
    assert set(run[100:200]) == {0}  # a newer one comes in every tick, and wins
    run = drive(
        300,
        second("messages-duplicated", sensor="imu", after_s=0.03),
        fault("messages-lost", sensor="imu", start_s=1.5, duration_s=0.1),
    )
    assert ages(run, "imu")[150:160] == [3, 3, 3, 4, 5, 6, 7, 8, 9, 10]


def test_late_fixes_keep_their_stamp():
    run, plain = drive(330, second("messages-late", sensor="gnss", delay_s=0.3)), drive(330)
    assert {fix.stamp_s: fix for fix in fixes(run)}.items() >= {
        fix.stamp_s: fix for fix in fixes(plain) if fix.stamp_s < 2.5
    }.items()
    late = [
        round(tick.frame.time_s - fix.stamp_s, 2)
        for tick in run
        for fix in tick.frame.gnss
        if 1.05 < fix.stamp_s < 2.05
    ]
    assert late and min(late) >= 0.41


def test_fixes_come_twice_out_of_order_or_never():
    twice = drive(330, second("messages-duplicated", sensor="gnss", after_s=0.15))
    stamps = [fix.stamp_s for fix in fixes(twice)]
    assert [round(stamp, 1) for stamp in sorted(set(stamps)) if stamps.count(stamp) == 2] == [
        round(1.1 + k / 10, 1) for k in range(10)
    ]
    assert stamps != sorted(stamps)
    mixed = [fix.stamp_s for fix in fixes(drive(330, second("messages-reordered", sensor="gnss", spread_s=0.5)))]
    assert mixed != sorted(mixed)
    assert sorted(set(mixed)) == sorted(mixed)
    lost = [round(fix.stamp_s, 1) for fix in fixes(drive(330, second("messages-lost", sensor="gnss")))]
    assert lost[:10] == [round(0.1 + k / 10, 1) for k in range(10)]
    assert lost[10] == 2.1


def test_fixes_take_any_extra_time_up_to_the_spread():
    spread = fault("messages-reordered", sensor="gnss", spread_s=0.03)
    run = drive(6000, spread, gnss=GnssNoise(latency_jitter_s=0, rate_hz=20))
    extra = [round((tick.frame.time_s - fix.stamp_s) * 100) - 11 for tick in run for fix in tick.frame.gnss]
    shares = np.bincount(extra) / len(extra)
    assert shares == pytest.approx([0.25] * 4, abs=0.05)


def test_several_fixes_can_arrive_in_one_tick():
    run = drive(330, second("messages-duplicated", sensor="gnss", after_s=0.0))
    assert {len(tick.frame.gnss) for tick in run} == {0, 1, 2}


def test_the_imus_bias_jumps_and_goes():
    run, plain = drive(300, second("imu-bias", gyro_radps=0.05, accel_mps2=-0.3)), drive(300)
    gyro = [a.frame.imu.gyro_z_radps - b.frame.imu.gyro_z_radps for a, b in zip(run, plain, strict=True)]
    accel = [a.frame.imu.accel_x_mps2 - b.frame.imu.accel_x_mps2 for a, b in zip(run, plain, strict=True)]
    assert gyro == pytest.approx([0.0] * 100 + [0.05] * 100 + [0.0] * 100)
    assert accel == pytest.approx([0.0] * 100 + [-0.3] * 100 + [0.0] * 100)


def test_a_shaken_imu_is_noisy_on_every_axis():
    run, plain = drive(300, second("imu-noisy", gyro_radps=0.1, accel_mps2=2.0)), drive(300)
    added = np.array([np.subtract(a.frame.imu, b.frame.imu) for a, b in zip(run, plain, strict=True)])
    assert np.std(added[100:200], axis=0) == pytest.approx([0.1] * 3 + [2.0] * 3, rel=0.3)
    assert not added[:100].any() and not added[200:].any()


def test_a_frozen_imu_repeats_itself():
    run, plain = drive(300, second("imu-stuck")), drive(300)
    assert {tick.frame.imu for tick in run[100:200]} == {run[99].frame.imu}
    assert [tick.frame.imu for tick in run[200:]] == [tick.frame.imu for tick in plain[200:]]


def test_a_disturbed_field_is_the_maps():
    run, plain = drive(300, second("magnetic-disturbance", east_t=5e-6)), drive(300)
    for index, (tick, right) in enumerate(zip(run, plain, strict=True)):
        heading = tick.state.heading_rad
        extra = 5e-6 if 100 <= index < 200 else 0.0
        assert tick.frame.mag.x_t - right.frame.mag.x_t == pytest.approx(extra * math.cos(heading), abs=3e-7)
        assert tick.frame.mag.y_t - right.frame.mag.y_t == pytest.approx(-extra * math.sin(heading), abs=3e-7)


def test_an_encoder_that_drops_out_never_catches_up():
    run, plain = drive(300, second("encoder-dropout", actuator="left")), drive(300)
    left = np.array([tick.frame.encoders[0] for tick in run])
    right = np.array([tick.frame.encoders[0] for tick in plain])
    assert (left[:100] == right[:100]).all()
    assert np.ptp(left[99:200]) == 0.0
    missed = right[200:] - left[200:]
    assert np.ptp(missed) < 1e-3
    assert missed[0] == pytest.approx(10.0, rel=0.02)
    assert [tick.frame.encoders[1] for tick in run] == [tick.frame.encoders[1] for tick in plain]
    assert run[-1].state == plain[-1].state
