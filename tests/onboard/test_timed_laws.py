"""Tracking laws in a small closed loop: poles, Lyapunov functions, disturbances, and references that stop."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from touchline.onboard.control.frenet_law import FrenetLaw, path_yaw_rate_radps
from touchline.onboard.control.timed.dynamic import DynamicLaw
from touchline.onboard.control.timed.linear import LinearLaw
from touchline.onboard.control.timed.linear_scaled import ScaledLinearLaw
from touchline.onboard.control.timed.nonlinear import NonlinearLaw
from touchline.onboard.control.timed.regularised import RegularisedLaw
from touchline.onboard.control.timed.tracking_law import LAW_MEMORY, TrackingErrors, Wanted, steer
from touchline_research.tracking.tracking_loop import (
    STEP_S,
    STUDIED,
    Disturbances,
    TimedReference,
    Tracked,
    by_law,
    reference_of,
    track_reference,
)

A, ZETA, B = 1.0, 1.0, 10.0
LAWS: dict[str, Any] = {
    "linear": LinearLaw(A, ZETA),
    "linear-scaled": ScaledLinearLaw(ZETA, B),
    "nonlinear": NonlinearLaw(ZETA, B),
    "regularised": RegularisedLaw(A, ZETA, 0.02),
    "dynamic": DynamicLaw(A, ZETA, 0.02, STEP_S),
}
OFF, FAR_OFF = (-0.15, 0.2, -0.6), (-0.15, 0.2, 2.8)


def rest_to_rest(seed: int, duration_s: float = 20.0) -> TimedReference:
    """As fast as the studied robot at most, from rest to rest by a cubic law, with a bend to either side."""
    bend, swing = np.random.default_rng(seed).uniform(-0.6, 0.6, 2)

    def speed(t: np.ndarray) -> np.ndarray:
        part = t / duration_s
        return 0.2 * 4.0 * part * (1.0 - part)

    return reference_of(speed, lambda t: speed(t) * (bend + swing * np.cos(0.5 * t)), duration_s)


def stopping(t: np.ndarray) -> np.ndarray:
    """0.2 m/s, at rest from 8 s to 10 s, slowing down and speeding up smoothly within 2 s each."""
    part = np.clip(0.5 * np.maximum(8.0 - t, t - 10.0), 0.0, 1.0)
    return 0.2 * part * part * (3.0 - 2.0 * part)


def run(law: str, reference: TimedReference, *given: Any) -> Tracked:
    return track_reference(by_law(LAWS[law]), reference, *given)


@pytest.mark.parametrize("law", LAWS)
def test_from_a_perfect_start_it_stays_on_the_reference(law: str) -> None:
    distances = [run(law, rest_to_rest(seed)).distance_m for seed in range(3)]
    assert np.sqrt(np.mean(np.square(distances))) < 1e-3


@pytest.mark.parametrize("law", LAWS)
def test_started_off_the_reference_it_comes_to_it(law: str) -> None:
    settled = run(law, rest_to_rest(1), OFF)
    assert settled.distance_m[-1] < 0.01
    assert settled.distance_m[0] == pytest.approx(0.25)
    assert abs(settled.errors[-1, 2]) < 0.05


@pytest.mark.parametrize(
    ("law", "turned"), [("linear", 0), ("linear-scaled", 0), ("nonlinear", 0), ("regularised", 0), ("dynamic", 1)]
)
def test_looking_back_at_first_it_ends_looking_ahead_but_for_the_one_that_sees_no_heading(
    law: str, turned: int
) -> None:
    tracked = run(law, reference_of(lambda t: 0.0 * t + 0.2, lambda t: 0.06 * np.cos(0.5 * t), 15.0), FAR_OFF)
    assert tracked.distance_m[-1] < 0.01
    assert math.cos(tracked.errors[-1, 2]) == pytest.approx(-1.0 if turned else 1.0, abs=0.01)


def motion(law: Any, errors: np.ndarray, wanted: Wanted) -> np.ndarray:
    """Derivative of the errors in the closed loop."""
    v, w = steer(law, TrackingErrors(*errors.tolist()), wanted, np.zeros(LAW_MEMORY))
    e1, e2, e3 = errors.tolist()
    return np.array(
        [
            w * e2 + wanted.speed_mps * math.cos(e3) - v,
            wanted.speed_mps * math.sin(e3) - w * e1,
            wanted.yaw_rate_radps - w,
        ]
    )


@pytest.mark.parametrize("v", [0.05, 0.26, 1.0, -0.5])
@pytest.mark.parametrize("w", [0.0, 0.4, -0.9])
def test_the_poles_are_where_they_are_meant_to_be(v: float, w: float) -> None:
    """By the polynomial that they are the roots of: where two of them meet they themselves hang on the last digits."""

    def coefficients(law: Any) -> np.ndarray:
        h = 1e-6
        wanted = Wanted(v, w)
        columns = [(motion(law, h * axis, wanted) - motion(law, -h * axis, wanted)) / (2.0 * h) for axis in np.eye(3)]
        return np.poly(np.linalg.eigvals(np.column_stack(columns)))

    def wanted_of(k: float, a_squared: float) -> np.ndarray:
        return np.polymul([1.0, k], [1.0, k, a_squared])

    for a, zeta in ((1.0, 1.0), (2.5, 0.7)):
        wanted = wanted_of(2.0 * zeta * a, a * a)
        assert coefficients(LinearLaw(a, zeta)) == pytest.approx(wanted, abs=1e-6 * np.abs(wanted).max())
    squared = w * w + B * v * v
    scaled = wanted_of(2.0 * ZETA * math.sqrt(squared), squared)
    for law in (ScaledLinearLaw(ZETA, B), NonlinearLaw(ZETA, B)):
        assert coefficients(law) == pytest.approx(scaled, abs=1e-6 * np.abs(scaled).max())
    regularised = wanted_of(2.0 * ZETA * A, A * A * v * v / (v * v + 0.02**2) + w * w)
    assert coefficients(RegularisedLaw(A, ZETA, 0.02)) == pytest.approx(regularised, abs=1e-6)


def test_the_lyapunov_function_of_the_nonlinear_law_never_rises() -> None:
    rng = np.random.default_rng(5)
    law, h = LAWS["nonlinear"], 0.02
    for _ in range(100):
        errors = rng.uniform(-1.0, 1.0, 3) * (1.0, 1.0, 3.0)
        v, w, rate = rng.uniform(-0.5, 0.5), rng.uniform(-1.0, 1.0), rng.uniform(0.1, 2.0)
        for i in range(40):
            swing = math.cos(rate * h * i)
            wanted = Wanted(v * swing, w)
            change = motion(law, errors, wanted)
            rise = B * (errors[0] * change[0] + errors[1] * change[1]) + errors[2] * change[2]
            k = 2.0 * ZETA * math.sqrt(w * w + B * (v * swing) ** 2)
            assert rise == pytest.approx(-k * (B * errors[0] ** 2 + errors[2] ** 2), abs=1e-12)
            assert rise <= 1e-12
            errors = errors + h * change


def resting_command_radps(law: str, disturbances: Disturbances, around_s: float) -> float:
    """Largest yaw rate asked for while the reference rests for 2 s, and so long before and after."""
    reference = reference_of(stopping, lambda t: 0.0 * t, 18.0)
    t = STEP_S * np.arange(len(reference.poses))
    near = (t >= 8.0 - around_s) & (t <= 10.0 + around_s)
    runs = [run(law, reference, (0.0, 0.002, 0.002), disturbances, seed) for seed in range(3)]
    return max(float(np.abs(each.commands[near, 1]).max()) for each in runs)


@pytest.mark.parametrize("law", ["regularised", "linear-scaled", "nonlinear", "dynamic"])
def test_a_reference_that_stops_on_its_way_asks_for_nothing_wild(law: str) -> None:
    assert resting_command_radps(law, STUDIED, 0.0) < 0.1
    assert resting_command_radps(law, STUDIED._replace(position_m=0.0, heading_rad=0.0), 4.0) < 0.1


def test_the_linear_law_asks_for_the_impossible_where_the_reference_stops() -> None:
    assert resting_command_radps("linear", STUDIED, 2.0) > 10.0


CASES = 10_000


def test_the_lyapunov_function_of_the_path_law_falls_by_the_angle_alone() -> None:
    """And with the sign as printed in the study, 1 + c·l, it does not."""
    rng = np.random.default_rng(3)
    law = FrenetLaw(4.0, 3.0)
    lateral, angle, share, speed = rng.uniform(-1.0, 1.0, (4, CASES)) * np.array([[1.0], [3.0], [0.9], [1.5]])
    curvature = share / lateral
    rows = np.column_stack((lateral, angle, curvature, speed)).tolist()
    yaw_rate = np.array([path_yaw_rate_radps(law, *row) for row in rows])
    along = speed * np.cos(angle)
    forward = along * curvature / (1.0 - share)

    def rise(yaw_rate: np.ndarray) -> np.ndarray:
        return 4.0 * lateral * speed * np.sin(angle) + angle * (yaw_rate - forward)

    scale = 1.0 + np.abs(forward * angle)
    assert np.all(np.abs(rise(yaw_rate) + 3.0 * angle * angle) <= 1e-9 * scale)
    printed = rise(yaw_rate - forward + along * curvature / (1.0 + share))
    assert np.mean(np.abs(printed + 3.0 * angle * angle) > 1e-6 * scale) > 0.99
    assert printed.max() > 0.0


def circle(feed_forward: float) -> float:
    """Distance that is left on a circle of 1 m with this share of the curvature fed forward [m]."""
    law, lateral, angle, h, speed, c = FrenetLaw(4.0, 4.0), 0.05, 0.1, 0.002, 0.5, 1.0
    for _ in range(20_000):
        along = speed * math.cos(angle) / (1.0 - c * lateral)
        w = path_yaw_rate_radps(law, lateral, angle, c, speed) + (feed_forward - 1.0) * c * along
        lateral, angle = lateral + h * speed * math.sin(angle), angle + h * (w - c * along)
    return lateral


def test_on_a_circle_the_path_law_leaves_nothing_and_less_feed_forward_would() -> None:
    assert abs(circle(1.0)) < 1e-3
    assert circle(0.8) == pytest.approx((0.8 - 1.0) / 4.0, rel=0.15)
