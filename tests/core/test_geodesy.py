"""Local plane ↔ WGS 84."""

import math

import pymap3d
import pytest
from hypothesis import given
from hypothesis import strategies as st

from touchline.core.geodesy import FLATTENING, SEMI_MAJOR_M, local_frame, to_geodetic, to_local
from touchline.schemas.placement import offset_m
from touchline.schemas.scenario import Origin

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


def test_the_published_example_of_a_topocentric_frame():
    """EPSG guidance note 7-2, geographic/topocentric conversions (methods 9602 and 9837), WGS 84."""
    frame = local_frame(55.0, 5.0, 200.0)
    there = (53.0 + 48.0 / 60.0 + 33.82 / 3600.0, 2.0 + 7.0 / 60.0 + 46.38 / 3600.0, 73.0)
    assert to_local(frame, *there) == pytest.approx((-189_013.869, -128_642.040, -4_220.171), abs=1e-3)
    latitude, longitude, height = to_geodetic(frame, -189_013.869, -128_642.040, -4_220.171)
    assert (latitude, longitude) == pytest.approx(there[:2], abs=1e-8)
    assert height == pytest.approx(there[2], abs=1e-3)
    assert _earth_centred(55.0, 5.0, 200.0) == pytest.approx((3_652_755.3058, 319_574.6799, 5_201_547.3536), abs=1e-4)
    assert _earth_centred(*there) == pytest.approx((3_771_793.968, 140_253.342, 5_124_304.349), abs=1e-3)


def _earth_centred(latitude, longitude, height):
    """(X, Y, Z) by the plane at (0°, 0°, 0 m), whose up, east and north they are, beside the semi-major axis."""
    east, north, up = to_local(local_frame(0.0, 0.0, 0.0), latitude, longitude, height)
    return up + SEMI_MAJOR_M, east, north


def test_the_plane_leaves_the_curved_earth():
    _, _, altitude = to_geodetic(DENMARK, 1000.0, 0.0, 0.0)
    assert altitude - 20.0 == pytest.approx(1000.0**2 / (2 * 6.39e6), rel=0.01)


@given(st.floats(-89, 89), st.floats(-180, 180), st.floats(-500, 9000), WITHIN_1_KM, WITHIN_1_KM, st.floats(-100, 100))
def test_the_kernels_agree_with_the_library_that_places_templates(latitude, longitude, altitude, east, north, up):
    frame, origin = local_frame(latitude, longitude, altitude), (latitude, longitude, altitude)
    there = to_geodetic(frame, east, north, up)
    expected = pymap3d.enu2geodetic(east, north, up, *origin)
    assert there[0] == pytest.approx(expected[0], abs=1e-9)
    assert math.remainder(there[1] - expected[1], 360.0) == pytest.approx(0.0, abs=1e-9)
    assert there[2] == pytest.approx(expected[2], abs=1e-6)
    assert to_local(frame, *there) == pytest.approx(pymap3d.geodetic2enu(*there, *origin), abs=1e-6)


@given(st.floats(-85, 85), st.floats(-180, 180), st.floats(-0.02, 0.02), st.floats(-0.02, 0.02))
def test_templates_are_carried_over_as_fixes_are_understood(
    latitude: float, longitude: float, north: float, east: float
) -> None:
    here = Origin(latitude_deg=latitude, longitude_deg=longitude)
    there = Origin(latitude_deg=latitude + north, longitude_deg=min(max(longitude + east, -180.0), 180.0))
    frame = local_frame(here.latitude_deg, here.longitude_deg, here.altitude_m)
    x, y, _ = to_local(frame, there.latitude_deg, there.longitude_deg, there.altitude_m)
    assert offset_m(there, here) == pytest.approx((x, y), abs=1e-6)
