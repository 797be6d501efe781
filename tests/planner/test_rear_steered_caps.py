"""Limits that plans keep for a rear-steered drive."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from touchline.schemas.vehicles.shipped import CLAY_ROLLER
from touchline.services.planner.drives import planned_drive as kernels
from touchline.services.planner.drives.planned_drive import planned_drive

DRIVE, PLANNED = CLAY_ROLLER.drive, planned_drive(CLAY_ROLLER)
ONE = np.ones(1)


@given(st.floats(-1.0, 1.0), st.floats(0.01, 5.0))
def test_at_the_largest_speed_for_a_sharpness_the_steering_keeps_its_rate(bend: float, sharpness: float) -> None:
    curvature = bend * PLANNED.curvature_max_1pm
    square = kernels.square_cap(PLANNED.caps, abs(curvature), sharpness)
    value, rate = PLANNED.actuation(ONE, square * ONE, 0.0 * ONE, curvature * ONE, sharpness * ONE)
    assert square <= DRIVE.top_speed_mps**2
    assert abs(rate[1, 0]) <= DRIVE.max_steering_rate_radps
    assert value[1, 0] == pytest.approx(-math.atan(DRIVE.wheelbase_m * curvature))
    if curvature == 0.0 and square < DRIVE.top_speed_mps**2:
        assert abs(rate[1, 0]) == pytest.approx(DRIVE.max_steering_rate_radps, rel=1e-5)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_actuation_is_the_bicycles(direction: float) -> None:
    """Against a numeric derivative of δ = −atan(L·κ) along a clothoid, whichever way it is driven."""
    curvature, sharpness, speed, step = 0.1, 0.2, 0.8, 1e-6
    value, rate = PLANNED.actuation(direction * ONE, speed**2 * ONE, 0.1 * ONE, curvature * ONE, sharpness * ONE)
    later, _ = PLANNED.actuation(
        direction * ONE, speed**2 * ONE, 0.1 * ONE, (curvature + sharpness * speed * step) * ONE, sharpness * ONE
    )
    assert (later[1] - value[1]) / step == pytest.approx(rate[1], rel=1e-4)
    assert value[0] == pytest.approx(direction * speed / DRIVE.drum_radius_m)
    assert rate[0] == pytest.approx(direction * 0.1 / DRIVE.drum_radius_m)


def test_its_limits_are_those_of_the_study() -> None:
    assert pytest.approx(3.661, abs=0.001) == 1.0 / PLANNED.curvature_max_1pm
    assert PLANNED.sharpness_at(1.0) == pytest.approx(0.25, rel=1e-5)
    assert not DRIVE.can_spin and DRIVE.can_reverse
    assert PLANNED.turns_within(DRIVE.max_lateral_acceleration_mps2)


def test_on_clay_it_draws_four_kilowatts() -> None:
    speed = np.full(50, 1.0)
    power = PLANNED.power_w(speed, 0.0 * speed, np.full(50, CLAY_ROLLER.mass_full_kg), 0.02)
    assert power.mean() == pytest.approx(3900.0, rel=0.1)
