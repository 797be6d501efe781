"""The onboard side of drives: the shipped one by known answers, and one of somebody else."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from touchline.onboard import filter_model as m
from touchline.onboard import tracking_state as tracking
from touchline.onboard.drives import onboard_drive
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.schemas.errors import CommandRefused
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.shipped import TURTLEBOT2

VEHICLE = Vehicle()
DRIVE = drive_of(VEHICLE)
RADIUS_M, TRACK_M = VEHICLE.drive.wheel_radius_m, VEHICLE.drive.track_width_m


def now(slips=(0.0, 0.0), speed_mps=0.0, yaw_rate_radps=0.0) -> np.ndarray:
    values, x = np.zeros(tracking.COMMAND + 2), np.zeros(m.STATES)
    x[m.ODOMETRY_ERROR : m.ODOMETRY_ERROR + 2] = slips
    values[tracking.SPEED], values[tracking.YAW_RATE] = speed_mps, yaw_rate_radps
    onboard_drive.effective(DRIVE.figures, x, values)
    return values


def test_wheels_on_a_circle() -> None:
    """At 1 m/s with 0.5 1/m the wheels run on circles of 2 m less and more half a track."""
    left, right = onboard_drive.actuators_of(DRIVE.figures, 1.0, 0.5, now())
    assert left * RADIUS_M == pytest.approx((2.0 - 0.5 * TRACK_M) * 0.5)
    assert right * RADIUS_M == pytest.approx((2.0 + 0.5 * TRACK_M) * 0.5)


@given(st.floats(-2.0, 2.0), st.floats(-3.0, 3.0), st.floats(-0.04, 0.04), st.floats(-0.04, 0.04))
def test_twist_is_the_inverse_and_gain_its_derivative(v: float, w: float, left_slip: float, right_slip: float) -> None:
    figures, place = DRIVE.figures, now((left_slip, right_slip))
    wheels = np.array(onboard_drive.actuators_of(figures, v, w, place))
    assert onboard_drive.twist(figures, wheels, place) == pytest.approx((v, w), abs=1e-12)
    for wheel in range(2):
        faster = wheels.copy()
        faster[wheel] += 1.0
        difference = np.subtract(onboard_drive.twist(figures, faster, place), (v, w))
        assert onboard_drive.gain(figures, wheel, place) == pytest.approx(tuple(difference), abs=1e-9)


@given(st.floats(-5.0, 5.0), st.floats(-20.0, 20.0), st.floats(-1.0, 1.0))
def test_commands_keep_the_wheels_limits(v: float, w: float, speed_mps: float) -> None:
    place, wheels = now(speed_mps=speed_mps), np.zeros(2)
    onboard_drive.command(DRIVE.figures, v, w, place, wheels)
    assert np.abs(wheels).max() <= VEHICLE.drive.max_wheel_speed_radps
    assert np.abs(wheels - speed_mps / RADIUS_M).max() <= DRIVE.reach[0] + 1e-9


@given(st.floats(0.3, 1.5), st.floats(-1.0, 1.0), st.floats(-0.03, 0.03), st.floats(-0.03, 0.03))
def test_odometry_of_what_is_true_leaves_no_innovation(v: float, w: float, left_slip: float, right_slip: float) -> None:
    x, z, h = np.zeros(m.STATES), m.TickInputs(), np.zeros((2, m.STATES))
    x[[m.SPEED, m.YAW_RATE, m.ODOMETRY_ERROR, m.ODOMETRY_ERROR + 1]] = v, w, left_slip, right_slip
    for wheel, slip in enumerate((left_slip, right_slip)):
        over_ground = v + (2 * wheel - 1) * 0.5 * TRACK_M * w
        z.odometry[wheel] = z.smooth[wheel] = over_ground / (1.0 - slip)
    y0, y1, variance = onboard_drive.odometry(DRIVE.figures, x, z.array[0], h)
    assert (y0, y1) == pytest.approx((0.0, 0.0), abs=1e-12) and variance > 0.0
    for state in (m.SPEED, m.YAW_RATE, m.ODOMETRY_ERROR, m.ODOMETRY_ERROR + 1):
        moved = x.copy()
        moved[state] += 1e-3
        changed = np.array(onboard_drive.odometry(DRIVE.figures, moved, z.array[0], np.zeros((2, m.STATES)))[:2])
        assert -changed / 1e-3 == pytest.approx(h[:, state], abs=1e-6), "the Jacobian is the derivative"


def test_turning_on_the_spot_and_tight_curves_have_limits() -> None:
    assert DRIVE.spin_acceleration_radps2() == pytest.approx(VEHICLE.drive.max_acceleration_mps2 / (0.5 * TRACK_M))
    assert drive_of(TURTLEBOT2).spin_acceleration_radps2() == pytest.approx(0.5 * 3.14 / 0.7), "yaw rate limits it"
    DRIVE.check_curvature("it", 2.0 / TRACK_M)
    with pytest.raises(CommandRefused, match=r"it has a radius of 0\.250 m, less than half the track"):
        DRIVE.check_curvature("it", 4.0)
    with pytest.raises(CommandRefused, match=r"second: 2\.10 m/s at curvature .* needs a wheel speed of 21\.00"):
        DRIVE.check_speeds(np.array([1.0, 2.1]), np.zeros(2), ("first", "second").__getitem__)
    with pytest.raises(CommandRefused, match=r"turning on the spot at 9.00 rad/s needs a wheel speed"):
        DRIVE.check_spin("it", 9.0)
