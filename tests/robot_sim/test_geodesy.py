"""Local plane ↔ WGS 84."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.robot_sim.sensors.geodesy import FLATTENING, SEMI_MAJOR_M, local_frame, to_geodetic, to_local

DENMARK = local_frame(57.0124, 9.9915, 20.0)
to_local(DENMARK, *to_geodetic(DENMARK, 0.0, 0.0, 0.0))  # compiles, if need be, before anything is timed
WITHIN_1_KM = st.floats(-1000, 1000)


@given(WITHIN_1_KM, WITHIN_1_KM, st.floats(-5, 5))
def test_round_trip(east, north, up):
    assert to_local(DENMARK, *to_geodetic(DENMARK, east, north, up)) == pytest.approx((east, north, up), abs=1e-7)


@given(st.floats(-89, 89), st.floats(-180, 180), st.floats(-500, 9000), WITHIN_1_KM, WITHIN_1_KM)
def test_round_trip_anywhere(latitude, longitude, altitude, east, north):
    frame = local_frame(latitude, longitude, altitude)
    assert to_local(frame, *to_geodetic(frame, east, north, 0.0)) == pytest.approx((east, north, 0.0), abs=1e-7)


def test_the_origin_is_the_origin():
    assert to_geodetic(DENMARK, 0.0, 0.0, 0.0) == pytest.approx((57.0124, 9.9915, 20.0), abs=1e-9)


def test_a_degree_is_as_long_as_the_radii_of_curvature_say():
    e2, sin = FLATTENING * (2 - FLATTENING), math.sin(math.radians(57.0124))
    normal = SEMI_MAJOR_M / math.sqrt(1 - e2 * sin**2)
    meridian = SEMI_MAJOR_M * (1 - e2) / (1 - e2 * sin**2) ** 1.5
    step = 1e-4  # small, so that chord and arc agree to 0.1 mm
    _, north, _ = to_local(DENMARK, 57.0124 + step, 9.9915, 20.0)
    assert north == pytest.approx(math.radians(step) * (meridian + 20.0), abs=1e-4)
    east, _, _ = to_local(DENMARK, 57.0124, 9.9915 + step, 20.0)
    assert east == pytest.approx(math.radians(step) * (normal + 20.0) * math.cos(math.radians(57.0124)), abs=1e-4)


def test_the_plane_leaves_the_curved_earth():
    _, _, altitude = to_geodetic(DENMARK, 1000.0, 0.0, 0.0)
    assert altitude - 20.0 == pytest.approx(1000.0**2 / (2 * 6.39e6), rel=0.01)
