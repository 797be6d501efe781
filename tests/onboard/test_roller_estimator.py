"""The filter on the emulated roller; `python -m benchmarks roller` is the same with a hundred runs."""

import math
from collections.abc import Iterable

import numpy as np
import pytest
from scipy.special import chdtri

from benchmarks.roller import (
    CLAY,
    REST_FROM,
    REST_TICKS,
    VEHICLE,
    EmulatedRoller,
    Run,
    drive,
    go_on,
    lane,
    nees_of,
    speed_mps,
    stop,
    wander,
)
from tests.with_full import with_full
from touchline.onboard import filter_model as m
from touchline.onboard.estimation.filter import Estimator
from touchline.schemas.onboard import OnboardConfig

pytestmark = pytest.mark.xdist_group("roller")  # its kernels are compiled in one worker

WITHIN = float(chdtri(3, 0.0027))


@pytest.mark.parametrize("seeds", with_full([2, 4], full=[range(1, 7)]), ids=["two", "six"])
def test_position_and_heading_are_as_uncertain_as_they_say(seeds: Iterable[int]) -> None:
    nees = [nees_of(course, seed) for seed in seeds for course in (lane, wander)]
    assert 2.0 < float(np.mean(nees)) < 4.0


@pytest.mark.parametrize("seed", with_full(1, full=(2, 3)))
def test_the_offset_is_found_in_a_minute_and_bridges_an_outage(seed: int) -> None:
    run = drive(lane, 6000, seed)
    assert abs(run.offset_error_rad) < math.radians(0.15)
    go_on(run, lane, 6001, 9000, silent_from=6000)
    assert run.nees < WITHIN
    assert math.sqrt(run.estimator.covariance[m.HEADING, m.HEADING]) < math.radians(0.4)


def test_a_minute_at_rest_with_the_steering_turned_changes_nothing() -> None:
    run = drive(stop, REST_FROM, 5)
    before = run.estimator.state[: m.SPEED].copy()
    go_on(run, stop, REST_FROM + 1, REST_FROM + REST_TICKS)
    assert run.estimator.wheels_stand
    assert run.nees < WITHIN
    assert run.estimator.state[: m.SPEED] == pytest.approx(before, abs=0.01)


def bends_to_one_side(tick: int) -> tuple[float, float]:
    """Straights and half turns, as on a pan that is covered from the outside inward."""
    return speed_mps(tick), 0.48 if tick % 2000 > 1000 else 0.0


def test_slip_in_bends_is_not_taken_for_an_antenna_that_is_elsewhere() -> None:
    run = Run(EmulatedRoller(CLAY, 2, VEHICLE), Estimator(VEHICLE, OnboardConfig()))
    go_on(run, bends_to_one_side, 1, 15_000)
    assert run.nees < WITHIN
