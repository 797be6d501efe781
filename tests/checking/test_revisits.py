"""Errors of fixes compared over passes: bent by the place, or new each time."""

import numpy as np
import pytest

from touchline.checking.estimating.revisits import compared

SIDES_M = np.array([(0.0, 0.0), (20.0, 0.0), (20.0, 4.0), (0.0, 4.0)])
LAP_M = 48.0
SPEED_MPS = 0.9


def laps(count):
    """Times and places of a robot that goes round a field of 20 x 4 m."""
    time_s = np.arange(count * LAP_M / SPEED_MPS)
    corners_m = np.array([0.0, 20.0, 24.0, 44.0, LAP_M])
    around, driven_m = np.concatenate((SIDES_M, SIDES_M[:1])), (SPEED_MPS * time_s) % LAP_M
    return time_s, np.column_stack([np.interp(driven_m, corners_m, around[:, axis]) for axis in (0, 1)])


def wandering(n, sigma_m, rng, tau_s=6.0):
    """(n, 2) errors a second apart that move within seconds."""
    errors = sigma_m * rng.standard_normal((n, 2))
    keep = np.exp(-1.0 / tau_s)
    for i in range(1, n):
        errors[i] = keep * errors[i - 1] + np.sqrt(1.0 - keep**2) * errors[i]
    return errors


def bend(places_m, sigma_m, rng, length_m=3.0):
    """Errors of a map that is bent at random, alike at the same place."""
    phases = places_m @ rng.standard_normal((2, 200)) / length_m
    waves = np.concatenate((np.cos(phases), np.sin(phases)), axis=1)
    return sigma_m / np.sqrt(200) * waves @ rng.standard_normal((400, 2))


@pytest.mark.parametrize("seed", range(20))
def test_a_bent_map_is_found_on_three_laps_and_nothing_else_is(seed):
    rng = np.random.default_rng(seed)
    time_s, places_m = laps(3)
    errors_m = wandering(len(time_s), 0.01, rng)
    honest = compared(time_s, places_m, errors_m)
    assert honest.told
    assert not honest.bent
    assert honest.words == ""
    bent = compared(time_s, places_m, errors_m + bend(places_m, 0.03, rng))
    assert bent.bent
    assert "the fixes are bent at this place: by " in bent.words


def test_the_place_is_said():
    rng = np.random.default_rng(3)
    time_s, places_m = laps(4)
    near = np.exp(-0.5 * ((places_m - (15.0, 4.0)) ** 2).sum(axis=1) / 1.5**2)
    found = compared(time_s, places_m, wandering(len(time_s), 0.003, rng) + 0.03 * near[:, None])
    assert np.hypot(found.place_m[0] - 15.0, found.place_m[1] - 4.0) < 2.5
    assert 0.02 < found.bend_m < 0.06


def test_one_pass_tells_nothing():
    time_s, places_m = laps(1)
    found = compared(time_s, places_m, np.ones((len(time_s), 2)))
    assert found.pairs < 5  # where the lap ends at its beginning
    assert not found.told
    assert not compared(np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2))).told


def test_a_robot_that_rests_does_not_come_by_again():
    rng = np.random.default_rng(1)
    time_s, places_m = laps(1)
    rest_s = np.arange(100.0)
    resting = np.concatenate((places_m[:1] + 0.01 * rng.standard_normal((100, 2)), places_m))
    errors_m = np.concatenate((np.full((100, 2), 0.03), wandering(len(time_s), 0.01, rng)))
    found = compared(np.concatenate((rest_s, 100.0 + time_s)), resting, errors_m)
    assert found.pairs < 5
    assert not found.bent
