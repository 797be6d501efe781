"""Lanes of the study's tracker: where they end, and how fast they are driven."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.planner.strategies import floats
from touchline.onboard.control.lane_profile import lane_speed_mps
from touchline.schemas.errors import SpecError
from touchline.schemas.onboard import LanePursuit, OnboardConfig
from touchline.schemas.spec import parse
from touchline_research.lane_edges import lane_edges

STEP_M = 0.2
STUDY = LanePursuit()


def zigzag(lanes: list[tuple[int, int]]) -> tuple[np.ndarray, list[int]]:
    """Points of lanes, each with an S of half turns at its end, driven to and fro by the study's step; the cusps."""
    x = y = heading = 0.0
    points, cusps, sense = [(x, y)], [], 1.0
    for count, bend in lanes:
        for curvature in [0.0] * count + [0.2731] * bend + [-0.2731] * bend:
            heading += sense * STEP_M * curvature
            x, y = x + sense * STEP_M * math.cos(heading), y + sense * STEP_M * math.sin(heading)
            points.append((x, y))
        cusps.append(len(points) - 1)
        sense = -sense
    return np.array(points), cusps[:-1]


@given(
    st.lists(st.tuples(st.integers(3, 40), st.integers(0, 15)), min_size=1, max_size=6), floats(0, 7), st.integers(0)
)
def test_every_cusp_is_an_edge_and_nothing_else_is(lanes: list[tuple[int, int]], turn: float, seed: int) -> None:
    points, cusps = zigzag(lanes)
    turned = points @ np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    noisy = turned + np.random.default_rng(seed).uniform(-1e-3, 1e-3, points.shape)
    assert lane_edges(turned) == cusps
    assert lane_edges(noisy) == cusps


def test_points_that_coincide_are_no_edges() -> None:
    x = np.array([0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 1.0, 0.0, 0.0])
    assert lane_edges(np.column_stack((0.0 * x, x))) == [4]
    assert lane_edges(np.zeros((5, 2))) == []
    circle = np.linspace(0.0, 3 * math.tau, 200)
    assert lane_edges(np.column_stack((np.cos(circle), np.sin(circle)))) == []


@given(floats(0.3, 200.0))
def test_the_speed_rises_and_falls_by_the_acceleration_and_no_lane_is_too_short(lane_m: float) -> None:
    at = np.linspace(0.0, lane_m, 2000)
    speed = np.array([lane_speed_mps(s, lane_m - s, STUDY) for s in at])
    assert speed[0] == pytest.approx(STUDY.min_speed_mps)
    assert speed[-1] == 0.0
    assert speed.max() <= STUDY.max_speed_mps
    assert (speed.max() == STUDY.max_speed_mps) == (lane_m > 1.0 / 0.2 + 0.99 / 0.2)
    assert np.abs(np.diff(speed**2)).max() <= 2 * 0.1 * lane_m / 1999 + 1e-9


def test_a_long_lane_takes_as_long_as_it_should() -> None:
    """From 0.1 m/s to 1 m/s in 9 s, from there to rest in 10 s: D + 9.05 s; with the last 0.2 m cut off it is D + 7."""
    at = np.linspace(0.0, 93.0, 20_001)
    middle = 0.5 * (at[1:] + at[:-1])
    paces = [1.0 / lane_speed_mps(s, 93.0 - s, STUDY) for s in middle]
    assert sum(paces) * (at[1] - at[0]) == pytest.approx(93.0 + 9.05, abs=0.2)


def test_a_least_speed_above_the_largest_is_refused() -> None:
    with pytest.raises(SpecError, match="at most max_speed_mps"):
        parse(OnboardConfig, '{"lane_pursuit": {"min_speed_mps": 2}}', "computer.json")


def test_the_studys_settings_are_not_written() -> None:
    assert "lane_pursuit" not in OnboardConfig().model_dump_json()
    nearer = OnboardConfig(lane_pursuit=LanePursuit(lookahead_m=2.0))
    assert parse(OnboardConfig, nearer.model_dump_json(), "computer.json") == nearer
