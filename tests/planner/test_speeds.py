"""Speed profile and actuation profile: as fast as allowed, steady where painted, switched on time."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.planner.strategies import floats
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import Actuation, PlanOptions
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.drives.caps import gain
from touchline.services.planner.geometry.clothoid import Piece
from touchline.services.planner.limits import Limits
from touchline.services.planner.speed.actuation import PaintedStretch, actuation_profile
from touchline.services.planner.speed.path_grid import PathGrid
from touchline.services.planner.speed.timing import SpeedProfile, Steady, speed_profile
from touchline.services.planner.speed.topp import path_time

ACCELERATION = 0.8
VEHICLE = Vehicle()
LIMITS = replace(Limits.of(VEHICLE, PlanOptions()), acceleration_mps2=ACCELERATION, transit_speed_mps=2.0)


def stations(lengths: np.ndarray) -> np.ndarray:
    return np.concatenate(([0.0], np.cumsum(lengths)))


def columns(rows: Sequence[Sequence[float]]) -> np.ndarray:
    """The columns of a table, each in one piece, as kernels get them elsewhere: others would be compiled anew."""
    return np.ascontiguousarray(np.array(rows).T)


def straight(lengths_and_speeds: list[tuple[float, float]]) -> PathGrid:
    length, speed = columns(lengths_and_speeds)
    still = np.zeros(len(length))
    return PathGrid(stations(length), length, still, still, np.square(speed))


def with_borders(course: PathGrid, borders: list[float]) -> PathGrid:
    """The same straight course with more cells."""
    ends = np.cumsum(course.length_m)
    knots = np.unique([0.0, *ends, *(b for b in borders if 0.0 < b < ends[-1])])
    cap = course.square_cap[np.searchsorted(ends, 0.5 * (knots[1:] + knots[:-1]))]
    still = np.zeros(len(cap))
    return PathGrid(knots, np.diff(knots), still, still, cap)


def test_trapezium() -> None:
    profile = speed_profile(straight([(10.0, 2.0)]), [], replace(LIMITS, acceleration_mps2=1.0))
    assert profile.station_m.tolist() == [0.0, 2.0, 8.0, 10.0]
    assert profile.speed_mps.tolist() == [0.0, 2.0, 2.0, 0.0]
    assert profile.total_time_s == pytest.approx(2.0 + 3.0 + 2.0)
    assert profile.time_at(1.0) == pytest.approx(2.0**0.5)
    assert profile.station_at(3.0) == pytest.approx(4.0)


@given(st.lists(st.tuples(floats(0.001, 5.0), floats(0.1, 2.0)), min_size=1, max_size=12))
def test_caps_and_acceleration_are_kept_and_used(lengths_and_speeds: list[tuple[float, float]]) -> None:
    profile = speed_profile(straight(lengths_and_speeds), [], LIMITS)
    ends = np.cumsum([length for length, _ in lengths_and_speeds])
    caps = np.array([speed for _, speed in lengths_and_speeds])
    assert profile.speed_mps[0] == profile.speed_mps[-1] == 0.0
    assert profile.station_m[-1] == pytest.approx(ends[-1], abs=1e-12)
    squares = np.square(profile.speed_mps)
    slope = np.abs(np.diff(squares) / (2.0 * np.diff(profile.station_m)))
    assert slope.max() <= ACCELERATION * (1 + 1e-6)
    for start, end, cap in zip([0.0, *ends], ends, caps, strict=False):
        assert profile.speed_at(np.linspace(start, end, 9)).max() <= cap + 1e-9
    # Everywhere it is at a cap or at an acceleration limit: it cannot be faster.
    middle = 0.5 * (profile.station_m[1:] + profile.station_m[:-1])
    cap_at = caps[np.minimum(np.searchsorted(ends, middle), len(caps) - 1)]
    used = (slope > ACCELERATION * (1 - 1e-3)) | (profile.speed_at(middle) > cap_at - 1e-6)
    assert used[np.diff(profile.station_m) > 1e-6].all()


@given(
    st.lists(st.tuples(floats(1.0, 5.0), floats(0.3, 2.0)), min_size=2, max_size=8),
    st.lists(st.tuples(floats(0.2, 0.8), floats(0.01, 0.1)), max_size=3),
)
def test_steady_stretches_are_steady(
    lengths_and_speeds: list[tuple[float, float]], windows: list[tuple[float, float]]
) -> None:
    course = straight(lengths_and_speeds)
    total = float(course.length_m.sum())
    steady = [Steady(share * total, share * total + length * total, 1.0) for share, length in windows]
    profile = speed_profile(with_borders(course, [b for s in steady for b in s[:2]]), steady, LIMITS)
    for stretch in steady:
        speeds = profile.speed_at(np.linspace(stretch.start_m, stretch.end_m, 50))
        assert speeds.max() - speeds.min() < 1e-6
        assert 0.0 < speeds.max() <= stretch.speed_mps


@st.composite
def winding(draw: st.DrawFn) -> tuple[PathGrid, list[tuple[float, float, float]]]:
    """Clothoids whose curvature is continuous, cut into cells as a course's are."""
    curvature, rows = 0.0, []
    for _ in range(draw(st.integers(1, 6))):
        target, sharpness = draw(floats(-3.9, 3.9)), draw(floats(0.5, 30.0))
        parts = 2 + int(abs(target - curvature) / 0.1)
        length = max(abs(target - curvature) / sharpness, 1e-3) / parts
        slope = (target - curvature) / (length * parts)
        rows += [(length, curvature + slope * length * i, slope) for i in range(parts)]
        curvature = target
    length, bend, sharpness = columns(rows)
    tightest = np.maximum(np.abs(bend), np.abs(bend + sharpness * length))
    cap = LIMITS.square_cap(tightest, np.abs(sharpness))
    return PathGrid(stations(length), length, bend, sharpness, cap), rows


@given(winding())
def test_winding_paths_keep_both_wheels_at_every_millimetre(case: tuple[PathGrid, list]) -> None:
    course, rows = case
    profile = speed_profile(course, [], LIMITS)
    starts = np.concatenate(([0.0], np.cumsum(course.length_m)))
    at = np.unique(np.concatenate((np.arange(0.0, starts[-1], 1e-3), starts)))
    at = 0.5 * (at[1:] + at[:-1])
    cell = np.minimum(np.searchsorted(starts, at, side="right") - 1, len(rows) - 1)
    sharpness = course.sharpness_1pm2[cell]
    curvature = course.curvature_1pm[cell] + sharpness * (at - starts[cell])
    square = np.square(profile.speed_at(at))
    entry = np.clip(np.searchsorted(profile.station_m, at, side="right") - 1, 0, len(profile.station_m) - 2)
    gains = np.diff(np.square(profile.speed_mps)) / (2.0 * np.diff(profile.station_m))
    r, a = VEHICLE.drive.half_track_m, gains[entry]
    for side in (1, -1):
        rim = a * (1 + side * curvature * r) + side * square * sharpness * r
        assert np.abs(rim).max() <= VEHICLE.drive.max_wheel_acceleration_radps2 * VEHICLE.drive.wheel_radius_m * (
            1 + 1e-6
        )
        assert (np.sqrt(square) * np.abs(1 + side * curvature * r)).max() <= VEHICLE.drive.max_speed_mps * (1 + 1e-6)
    assert (square * np.abs(curvature)).max() <= VEHICLE.drive.max_lateral_acceleration_mps2 * (1 + 1e-6)
    assert np.abs(a).max() <= ACCELERATION * (1 + 1e-6)


@given(winding())
def test_the_time_of_a_transition_is_that_of_its_profile(case: tuple[PathGrid, list]) -> None:
    course, rows = case
    profile = speed_profile(course, [], LIMITS)
    # The estimate cuts every row into two cells more, whose caps are a little looser.
    pieces = np.array([Piece(*row) for row in rows])
    assert path_time(pieces, len(rows), 0.0, 0.0, LIMITS.caps) == pytest.approx(profile.total_time_s, rel=0.03)


def test_the_robot_stands_still_at_a_cusp_and_turns_on_the_spot() -> None:
    course = with_borders(straight([(6.0, 1.0)]), [2.0, 4.0])
    stopping = replace(course, stops=(1, 2), spins=((2, 1.0),))
    profile = speed_profile(stopping, [], LIMITS)
    assert profile.speed_at(np.array([2.0, 4.0])).tolist() == [0.0, 0.0]
    (spin,) = profile.spins
    assert (spin.station_m, spin.angle_rad) == (4.0, 1.0)
    rim_gain = ACCELERATION / VEHICLE.drive.half_track_m
    assert spin.rate_radps == pytest.approx(rim_gain**0.5)
    seconds = spin.seconds
    assert seconds == pytest.approx(2.0 / rim_gain**0.5)
    without = speed_profile(replace(course, stops=(1, 2)), [], LIMITS)
    assert profile.total_time_s == pytest.approx(without.total_time_s + seconds)
    assert profile.time_at(5.0) == pytest.approx(without.time_at(5.0) + seconds)
    assert profile.station_at(profile.time_at(4.0) + 0.5 * seconds) == pytest.approx(4.0)


def test_time_and_station_are_inverse() -> None:
    profile = speed_profile(straight([(2.0, 1.0), (1.0, 0.5), (3.0, 2.0)]), [], LIMITS)
    for station in np.linspace(0.0, 6.0, 25):
        assert profile.station_at(profile.time_at(float(station))) == pytest.approx(station, abs=1e-12)


def test_painting_from_standstill_is_refused() -> None:
    with pytest.raises(PlanningError, match="standstill"):
        speed_profile(with_borders(straight([(5.0, 1.0)]), [1.0]), [Steady(0.0, 1.0, 1.0)], LIMITS)


def masks(painted: list[PaintedStretch], speed: float = 1.0) -> list[tuple[float, int]]:
    steady = [Steady(p.start_m - 0.1, p.end_m, speed) for p in painted]
    course = with_borders(straight([(20.0, 1.4)]), [border for s in steady for border in s[:2]])
    profile: SpeedProfile = speed_profile(course, steady, replace(LIMITS, acceleration_mps2=1.0))
    return [(pytest.approx(s.station_m), s.mask) for s in actuation_profile(painted, profile, VEHICLE)]


def test_valve_and_discs_lead_by_their_delays() -> None:
    # 0.5 s before the line the robot is still slowing down from 1.4 to 1.0 m/s: 0.1 m at 1 m/s, the rest faster.
    lowered = 5.0 - 0.1 - (0.4 + 0.5 * 0.4**2)
    on, off = 5.0 - 0.015, 8.0 - 0.030
    disc, spray = Actuation.DISC, Actuation.DISC_SPRAY
    assert masks([PaintedStretch("a", 5.0, 8.0, "DISC_SPRAY")]) == [
        (0.0, 0),
        (lowered, disc),
        (on, spray),
        (off, disc),
        (8.0, 0),
    ]
    assert masks([PaintedStretch("a", 5.0, 8.0, "SPRAY")]) == [(0.0, 0), (on, Actuation.SPRAY), (off, 0)]


def test_close_lines_keep_the_discs_down_and_joined_ones_the_valve_open() -> None:
    close = masks([PaintedStretch("a", 5.0, 6.0, "DISC_SPRAY"), PaintedStretch("b", 6.2, 7.0, "DISC_SPRAY")])
    assert [mask for _, mask in close] == [0, 4, 7, 4, 7, 4, 0]
    joined = masks([PaintedStretch("a", 5.0, 6.0, "DISC_SPRAY"), PaintedStretch("b", 6.0, 7.0, "DISC_SPRAY")])
    assert [mask for _, mask in joined] == [0, 4, 7, 4, 0]


def test_a_line_shorter_than_the_valve_can_paint_is_named() -> None:
    with pytest.raises(PlanningError, match='segment "dot" is 14 mm long'):
        masks([PaintedStretch("dot", 5.0, 5.014, "SPRAY")])


@pytest.mark.parametrize("field", ["kappa_max_1pm", "sigma_max_1pm2", "paint_speed_mps", "transit_speed_mps"])
@pytest.mark.parametrize("value", [-1.0, float("nan"), float("inf"), 1e-6, 1e6])
def test_options_out_of_range_are_named(field: str, value: float) -> None:
    with pytest.raises(PlanningError, match=f"plan has {field} = "):
        Limits.of(VEHICLE, PlanOptions.model_construct(**{**PlanOptions().model_dump(), field: value}))


def test_turns_are_as_tight_as_the_wheels_and_the_grass_allow() -> None:
    """The outer wheel at its limit turns 1.5 m/s into 1.3126 1/m; tyres on grass (1.2 m/s²) bear less than half."""
    given = Limits.of(VEHICLE, PlanOptions())
    gripping = replace(given, lateral_mps2=1e9)
    assert gripping.turn_at(1.5)[0] == pytest.approx(1.3126, abs=1e-4)
    assert gripping.turn_at(1.556)[0] == pytest.approx(1.125, abs=2e-3)
    assert given.turn_at(1.5)[0] * 1.5**2 == pytest.approx(1.2)
    # Turning in at full sharpness leaves a fifth of the planned 16 rad/s² to the driving.
    wheel_acceleration = given.turn_at(1.5)[1] * 1.5**2 * VEHICLE.drive.half_track_m / VEHICLE.drive.wheel_radius_m
    assert wheel_acceleration == pytest.approx(12.8, rel=1e-5)


@given(floats(0.0, 4.0), floats(-3.9, 3.9), floats(-30.0, 30.0), floats(1e-4, 0.02))
def test_no_gain_drives_a_wheel_beyond_its_limit(square: float, curvature: float, slope: float, length: float) -> None:
    cap = LIMITS.square_cap(np.array([abs(curvature)]), np.array([abs(slope)]))[0]
    u, r = min(square, cap), VEHICLE.drive.half_track_m
    a = gain(u, curvature, slope, length, LIMITS.caps)
    assert 0.0 <= a <= ACCELERATION
    for s in np.linspace(0.0, length, 5):
        for side in (1, -1):
            rim = a * (1 + side * (curvature + slope * s) * r) + side * (u + 2 * a * s) * slope * r
            assert abs(rim) <= LIMITS.drive.acceleration_mps2 * (1 + 1e-9)
