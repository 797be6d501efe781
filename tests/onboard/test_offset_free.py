"""Followers on a robot whose pose they know exactly, but which drifts or is slower than it is told."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.onboard.test_followers import standing_inputs
from touchline.onboard import tracking_state as tracking
from touchline.onboard.control import make_follower
from touchline.onboard.control.lead import lead_ticks
from touchline.onboard.drives.onboard_drive import command as drive_command
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.trajectory import path_projection as projection
from touchline.schemas.vehicles import Vehicle

TICK_S = 0.01


def settled(name: str, nozzle_x_m: float = 0.0, drift_mps: float = 0.0, share: float = 1.0) -> tuple[float, float]:
    """Distance of the nozzle from a straight path [m] and speed of the robot [m/s] after 12 s at 1 m/s.

    It drifts to the left with `drift_mps`, and its wheels come to `share` of the speed that they are told.
    """
    vehicle = Vehicle(tool={"nozzle_x_m": nozzle_x_m})
    follower, drive = make_follower(name, vehicle), drive_of(vehicle)
    now, ahead = np.zeros(tracking.COMMAND + 2), np.zeros((follower.ahead_rows, projection.AHEAD_COLUMNS))
    ahead[:, projection.A_SPEED] = now[tracking.REFERENCE_SPEED] = 1.0
    now[tracking.EFFECT] = now[tracking.EFFECT + 1] = vehicle.drive.wheel_radius_m
    stay = math.exp(-TICK_S / vehicle.drive.motor_time_constant_s)
    wheels = np.full(2, share / vehicle.drive.wheel_radius_m)
    command = wheels / share
    lateral = heading = 0.0
    for _ in range(1200):
        wheels = share * command + stay * (wheels - share * command)
        left, right = (wheels * vehicle.drive.wheel_radius_m).tolist()
        speed, yaw_rate = 0.5 * (left + right), (right - left) / vehicle.drive.track_width_m
        heading += yaw_rate * TICK_S
        lateral += (speed * math.sin(heading) + drift_mps) * TICK_S
        now[tracking.LATERAL], now[tracking.HEADING_ERROR] = lateral, heading
        now[tracking.NOZZLE_LATERAL] = lateral + nozzle_x_m * math.sin(heading)
        now[tracking.SPEED], now[tracking.YAW_RATE] = speed, yaw_rate
        now[tracking.COMMAND : tracking.COMMAND + len(command)] = command
        drive_command(drive.figures, *follower.step(now, ahead)[:2], now, command)
    assert follower.fallbacks == 0
    return float(now[tracking.NOZZLE_LATERAL]), speed


@pytest.mark.parametrize("nozzle_x_m", [-0.4, 0.0, 0.4])
def test_the_nozzle_is_on_its_line_wherever_it_sits(nozzle_x_m: float) -> None:
    """A robot that drifts has to head aside: the nozzle 40 cm before the axle is 12 mm off where the axle is not."""
    off, _ = settled("mpc", nozzle_x_m, drift_mps=0.03)
    assert abs(off) < 1e-3


@pytest.mark.parametrize("name", ["mpc", "pure-pursuit"])
def test_wheels_that_are_slower_than_told_cost_no_speed(name: str) -> None:
    off, speed = settled(name, share=0.95)
    assert speed == pytest.approx(1.0, abs=2e-3)
    assert abs(off) < 1e-6


def test_pure_pursuits_integral_takes_a_drift_away() -> None:
    """Without it the robot settles 9 mm beside its line."""
    off, _ = settled("pure-pursuit", drift_mps=0.03)
    assert abs(off) < 6e-3


@pytest.mark.parametrize("name", ["mpc", "pure-pursuit"])
def test_curves_are_fed_forward_as_far_ahead_as_the_motors_lag(name: str) -> None:
    vehicle = Vehicle()
    lead = lead_ticks(vehicle.drive.motor_time_constant_s)
    assert lead == round(vehicle.drive.motor_time_constant_s / TICK_S)
    turning = []
    for begins in (lead, lead + 1):
        now, ahead = standing_inputs()
        ahead[begins:, projection.A_YAW_RATE] = 0.5
        turning.append(make_follower(name, vehicle).step(now, ahead)[1])
    assert turning == pytest.approx([0.5, 0.0], abs=0.02)
