"""A fault changes no noise but its own, and whatever happens the world stays finite."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.robot_sim.open_loop import FAULTS, REST, VEHICLE, drive, errors, second
from touchline.schemas.plugins import SENSORS

TOUCHES = {
    "gnss-outage": ({}, {"gnss"}),
    "gnss-degraded": ({}, {"gnss"}),
    "corrections-lost": ({}, {"gnss"}),
    "gnss-wrong-fix": ({}, {"gnss"}),
    "gnss-noisy": ({}, {"gnss"}),
    "clock-skew": ({}, {"gnss"}),
    "imu-bias": ({}, {"imu"}),
    "imu-noisy": ({}, {"imu"}),
    "imu-stuck": ({}, {"imu"}),
    "magnetic-disturbance": ({}, {"mag"}),
    "encoder-dropout": ({}, {"encoders"}),
    "bumper": ({}, set()),
    "operator-lost": ({}, set()),
    "valve-stuck": ({"position": "open"}, set()),
    "disc-stuck": ({"position": "up"}, set()),
}
QUIET_RUNS = cache(drive)
"""Without a fault, and the same for every fault that is looked at beside it."""
SENSED = ("imu", "mag", "encoders", "gnss")


@pytest.mark.parametrize("kind", TOUCHES)
def test_a_fault_of_one_sensor_changes_no_bit_of_another_nor_of_itself_once_it_is_over(kind):
    fields, touched = TOUCHES[kind]
    run = drive(1300, second(kind, **fields), command=REST)
    plain = QUIET_RUNS(1300, command=REST)
    if kind == "encoder-dropout":
        touched = set()  # at rest nothing is missed
    for name in SENSED:
        same = [getattr(a.frame, name) == getattr(b.frame, name) for a, b in zip(run, plain, strict=True)]
        assert all(same[:100]), name
        assert all(same) == (name not in touched), name
        assert all(same[-50:]), name


def test_a_fault_of_the_drive_changes_no_sensor_noise():
    run, plain = drive(300, second("wheel-blocked")), QUIET_RUNS(300)

    def noise(tick):
        return (
            tick.frame.imu.gyro_z_radps - tick.state.mean_yaw_rate_radps,
            tick.frame.imu.accel_x_mps2 - tick.state.mean_accel_x_mps2,
        )

    for a, b in zip(run, plain, strict=True):
        assert noise(a) == pytest.approx(noise(b), abs=1e-9)
    for a, b in zip(errors(run), errors(plain), strict=True):
        assert a == pytest.approx(b, abs=1e-6)


TIMES = {"start_s": st.floats(0, 1.5), "duration_s": st.none() | st.floats(0.01, 1.5)}
NEEDED = {
    "delay_s": st.floats(0.01, 5),
    "white_m": st.floats(0.001, 100),
    "share": st.floats(0, 0.95),
    "sensor": st.sampled_from(SENSORS.names()),
}
ANY_FAULT = st.one_of(
    [st.builds(model, **TIMES, **{k: v for k, v in NEEDED.items() if k in model.model_fields}) for model in FAULTS]
)


@settings(max_examples=20, deadline=None)
@given(st.lists(ANY_FAULT, max_size=12), st.integers(0, 2**62))
def test_whatever_goes_wrong_the_world_stays_finite_and_the_same_again(faults, seed):
    run = drive(150, *faults, seed=seed)
    states, drives = np.array([tick.state for tick in run]), np.array([tick.drive for tick in run])
    for records in (states, drives):
        assert all(np.isfinite(records[name]).all() for name in records.dtype.names)
    frames = [tick.frame for tick in run]
    assert np.isfinite([(*frame.imu, *frame.mag, *frame.encoders) for frame in frames]).all()
    assert np.isfinite([fix for frame in frames for fix in frame.gnss]).all()
    assert all(0.0 <= frame.battery_fraction <= 1.0 for frame in frames)
    assert all(0.0 <= frame.tank_l <= VEHICLE.tool.tank_l for frame in frames)
    assert np.abs(states["speed_mps"]).max() < 3.0
    again = drive(150, *faults, seed=seed)
    assert [tick.frame for tick in again] == frames
