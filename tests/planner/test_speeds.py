"""Speed profile and actuation profile: as fast as allowed, steady where painted, switched on time."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from schemas.errors import PlanningError
from schemas.messages import Actuation, PlanOptions
from schemas.vehicle import Vehicle
from services.planner.actuation import Painted, actuation_profile
from services.planner.limits import Limits
from services.planner.timing import Cap, Steady, speed_profile
from tests.planner.strategies import floats

ACCELERATION = 0.8
VEHICLE = Vehicle()


def caps_of(lengths_and_speeds: list[tuple[float, float]]) -> list[Cap]:
    ends = np.cumsum([length for length, _ in lengths_and_speeds]).tolist()
    return [Cap(end, speed, ACCELERATION) for end, (_, speed) in zip(ends, lengths_and_speeds, strict=True)]


def test_trapezium() -> None:
    profile = speed_profile([Cap(10.0, 2.0, 1.0)], [])
    assert profile.station_m.tolist() == [0.0, 2.0, 8.0, 10.0]
    assert profile.speed_mps.tolist() == [0.0, 2.0, 2.0, 0.0]
    assert profile.total_time_s == pytest.approx(2.0 + 3.0 + 2.0)
    assert profile.time_at(1.0) == pytest.approx(2.0**0.5)
    assert profile.station_at(3.0) == pytest.approx(4.0)


def test_triangle_when_there_is_no_room() -> None:
    profile = speed_profile([Cap(2.0, 5.0, 1.0)], [])
    assert profile.station_m.tolist() == [0.0, 1.0, 2.0]
    assert profile.speed_mps[1] == pytest.approx(2.0**0.5)


@given(st.lists(st.tuples(floats(0.001, 5.0), floats(0.1, 2.0)), min_size=1, max_size=12))
def test_caps_and_acceleration_are_kept_and_used(lengths_and_speeds: list[tuple[float, float]]) -> None:
    caps = caps_of(lengths_and_speeds)
    profile = speed_profile(caps, [])
    assert profile.speed_mps[0] == profile.speed_mps[-1] == 0.0
    assert profile.station_m[-1] == caps[-1].end_m
    squares = np.square(profile.speed_mps)
    slope = np.abs(np.diff(squares) / (2.0 * np.diff(profile.station_m)))
    assert slope.max() <= ACCELERATION * (1 + 1e-6)
    for start, cap in zip([0.0, *(c.end_m for c in caps)], caps, strict=False):
        inside = np.linspace(start, cap.end_m, 9)
        assert profile.speed_at(inside).max() <= cap.speed_mps + 1e-9
    # Everywhere it is at a cap or at an acceleration limit: it cannot be faster.
    middle = 0.5 * (profile.station_m[1:] + profile.station_m[:-1])
    cap_at = np.array([c.speed_mps for c in caps])[np.searchsorted([c.end_m for c in caps], middle)]
    used = (slope > ACCELERATION * (1 - 1e-3)) | (profile.speed_at(middle) > cap_at - 1e-6)
    assert used[np.diff(profile.station_m) > 1e-6].all()


@given(
    st.lists(st.tuples(floats(1.0, 5.0), floats(0.3, 2.0)), min_size=2, max_size=8),
    st.lists(st.tuples(floats(0.2, 0.8), floats(0.01, 0.1)), max_size=3),
)
def test_steady_stretches_are_steady(
    lengths_and_speeds: list[tuple[float, float]], windows: list[tuple[float, float]]
) -> None:
    caps = caps_of(lengths_and_speeds)
    total = caps[-1].end_m
    steady = [Steady(share * total, share * total + length * total, 1.0) for share, length in windows]
    profile = speed_profile(caps, steady)
    for stretch in steady:
        speeds = profile.speed_at(np.linspace(stretch.start_m, stretch.end_m, 50))
        assert speeds.max() - speeds.min() < 1e-6
        assert 0.0 < speeds.max() <= stretch.speed_mps


def test_time_and_station_are_inverse() -> None:
    profile = speed_profile(caps_of([(2.0, 1.0), (1.0, 0.5), (3.0, 2.0)]), [])
    for station in np.linspace(0.0, 6.0, 25):
        assert profile.station_at(profile.time_at(float(station))) == pytest.approx(station, abs=1e-12)


def test_painting_from_standstill_is_refused() -> None:
    with pytest.raises(PlanningError, match="standstill"):
        speed_profile([Cap(5.0, 1.0, 1.0)], [Steady(0.0, 1.0, 1.0)])


def masks(painted: list[Painted], speed: float = 1.0) -> list[tuple[float, int]]:
    steady = [Steady(p.start_m - 0.1, p.end_m, speed) for p in painted]
    profile = speed_profile([Cap(20.0, 1.4, 1.0)], steady)
    return [(pytest.approx(s.station_m), s.mask) for s in actuation_profile(painted, profile, VEHICLE)]


def test_valve_and_discs_lead_by_their_delays() -> None:
    # 0.5 s before the line the robot is still slowing down from 1.4 to 1.0 m/s: 0.1 m at 1 m/s, the rest faster.
    lowered = 5.0 - 0.1 - (0.4 + 0.5 * 0.4**2)
    on, off = 5.0 - 0.015, 8.0 - 0.030
    disc, spray = Actuation.DISC, Actuation.DISC_SPRAY
    assert masks([Painted("a", 5.0, 8.0, "DISC_SPRAY")]) == [
        (0.0, 0),
        (lowered, disc),
        (on, spray),
        (off, disc),
        (8.0, 0),
    ]
    assert masks([Painted("a", 5.0, 8.0, "SPRAY")]) == [(0.0, 0), (on, Actuation.SPRAY), (off, 0)]


def test_close_lines_keep_the_discs_down_and_joined_ones_the_valve_open() -> None:
    close = masks([Painted("a", 5.0, 6.0, "DISC_SPRAY"), Painted("b", 6.2, 7.0, "DISC_SPRAY")])
    assert [mask for _, mask in close] == [0, 4, 7, 4, 7, 4, 0]
    joined = masks([Painted("a", 5.0, 6.0, "DISC_SPRAY"), Painted("b", 6.0, 7.0, "DISC_SPRAY")])
    assert [mask for _, mask in joined] == [0, 4, 7, 4, 0]


def test_a_line_shorter_than_the_valve_can_paint_is_named() -> None:
    with pytest.raises(PlanningError, match='segment "dot" is 14 mm long'):
        masks([Painted("dot", 5.0, 5.014, "SPRAY")])


@pytest.mark.parametrize("field", ["kappa_max_1pm", "sigma_max_1pm2", "paint_speed_mps", "transit_speed_mps"])
@pytest.mark.parametrize("value", [-1.0, float("nan"), float("inf"), 1e-6, 1e6])
def test_options_out_of_range_are_named(field: str, value: float) -> None:
    with pytest.raises(PlanningError, match=f"plan has {field} = "):
        Limits.of(VEHICLE, PlanOptions.model_construct(**{**PlanOptions().model_dump(), field: value}))


def test_acceleration_is_less_where_its_cap_is() -> None:
    profile = speed_profile([Cap(1.0, 9.0, 2.0), Cap(2.0, 9.0, 0.5), Cap(10.0, 9.0, 2.0)], [])
    squares = np.square(profile.speed_at(np.array([0.0, 1.0, 2.0, 3.0])))
    assert squares.tolist() == pytest.approx([0.0, 4.0, 5.0, 9.0])


@given(floats(0.0, 10.0), floats(0.0, 100.0), floats(0.01, 2.0))
def test_on_any_stretch_no_wheel_is_beyond_its_limits(curvature: float, sharpness: float, wanted: float) -> None:
    limits = Limits.of(VEHICLE, PlanOptions())
    speed, along = limits.on(curvature, sharpness, wanted)
    r = VEHICLE.half_track_m
    assert 0.0 < speed <= wanted
    assert 0.0 < along <= VEHICLE.max_acceleration_mps2
    assert speed * (1 + curvature * r) <= VEHICLE.max_rim_speed_mps * (1 + 1e-12)
    rim = along * (1 + curvature * r) + speed**2 * sharpness * r
    assert rim <= VEHICLE.max_wheel_acceleration_radps2 * VEHICLE.wheel_radius_m
