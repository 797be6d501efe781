"""Refusals at load with their reasons, and the figures of a loaded trajectory."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.onboard.rig import chain, trajectory
from touchline.onboard.trajectory.trajectory import load_trajectory
from touchline.schemas.curves import Curve
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import (
    Actuation,
    LinearDirection,
    Path,
    Point,
    Trajectory,
    VelocityProfile,
    VelocityType,
)
from touchline.schemas.trajectories import velocity
from touchline.schemas.vehicles import Vehicle

VEHICLE = Vehicle()
GOOD = trajectory(chain((0.0, 5.0), (0.5, 3.0), (0.0, 5.0)), sprays=((2.0, 4.0), (6.0, 9.0)))


def with_segments(change: Callable[[list], list]) -> Trajectory:
    return GOOD.model_copy(update={"path": Path(segments=tuple(change(list(GOOD.path.segments))))})


def with_speeds(*rows: tuple[float, float], kind: int = VelocityType.LINEAR) -> Trajectory:
    entries = tuple(velocity(s, v, kind) for s, v in rows)
    return GOOD.model_copy(update={"velocity_profile": VelocityProfile(parameters=entries)})


def moved(dx: float, heading: float = 0.0) -> Trajectory:
    def change(segments: list) -> list:
        x, y, theta = Curve.from_message(segments[1].curve).end
        curve = Curve(x + dx, y, theta + heading, 0.0, 5.0).to_message()
        return [*segments[:2], segments[2].model_copy(update={"curve": curve})]

    return with_segments(change)


def with_nan() -> Trajectory:
    def change(segments: list) -> list:
        line = segments[0].curve.line[0].model_copy(update={"end": Point(x=math.nan)})
        curve = segments[0].curve.model_copy(update={"line": (line,)})
        return [segments[0].model_copy(update={"curve": curve}), *segments[1:]]

    return with_segments(change)


def backward(segments: list) -> list:
    direction = LinearDirection(value=LinearDirection.BACKWARD)
    return [segments[0], segments[1].model_copy(update={"direction": direction}), segments[2]]


REFUSED = {
    "no segments": (with_segments(lambda s: []), "no segments"),
    "nan": (with_nan(), 'segment 0 ("s0") has a coordinate that is not finite'),
    "gap": (moved(0.002), "gap of 2.0 mm between segment 1"),
    "kink": (moved(0.0, 0.002), "kink of 0.0020 rad"),
    "backward": (with_segments(backward), "kink of 3.1416 rad between segment 0"),
    "tight": (trajectory(chain((0.0, 5.0), (4.5, 1.0)), speed=0.3), "radius of 0.222 m"),
    "fast": (trajectory(chain((0.0, 5.0), (1.2, 3.0), (0.0, 5.0)), speed=1.6), "wheel speed of"),
    "no speeds": (with_speeds(), "velocity profile is empty"),
    "on the spot": (with_speeds((0.0, 1.0), kind=VelocityType.ANGULAR), "where the path has no turn on the spot"),
    "typeless": (with_speeds((0.0, 1.0), kind=VelocityType.NONE), "entry 0 is neither LINEAR nor ANGULAR"),
    "nan speed": (with_speeds((0.0, math.nan)), "entry 0 is not finite"),
    "negative": (with_speeds((0.0, 1.0), (2.0, -1.0)), "entry 1 is negative"),
    "unsorted": (with_speeds((0.0, 1.0), (5.0, 1.0), (3.0, 1.0)), "not sorted: entry 2"),
    "beyond": (with_speeds((0.0, 1.0), (50.0, 1.0)), "reaches from 0.000 m to 50.000 m"),
    "standing": (with_speeds((0.0, 1.0), (3.0, 0.0), (8.0, 0.0), (13.0, 1.0)), "stands still from 3.000 m"),
    "puddle": (with_speeds((0.0, 1.0), (2.0, 1.0), (3.0, 0.0), (4.0, 1.0)), "puddle"),
}


@pytest.mark.parametrize(("plan", "reason"), REFUSED.values(), ids=REFUSED.keys())
def test_refused_with_a_reason(plan: Trajectory, reason: str) -> None:
    with pytest.raises(CommandRefused) as refusal:
        load_trajectory(plan, VEHICLE)
    assert reason in str(refusal.value)


def test_good_one_is_taken() -> None:
    plan = load_trajectory(GOOD, VEHICLE)
    assert plan.total_length_m == pytest.approx(13.0)
    assert plan.ids == ["s0", "s1", "s2"]
    # 0.5 m up and 0.5 m down at 1 m/s², the rest at 1 m/s
    assert plan.total_time_s == pytest.approx(1.0 + 12.0 + 1.0)


def test_constant_speed_from_a_foreign_client_is_taken() -> None:
    assert load_trajectory(with_speeds((0.0, 1.0)), VEHICLE).total_time_s == pytest.approx(13.0)


def test_actuation_is_a_step_function() -> None:
    plan = load_trajectory(GOOD, VEHICLE)
    assert [plan.actuation_at(s) for s in (-1.0, 0.0, 1.999, 2.0, 3.999, 4.0, 8.0, 12.0)] == [
        Actuation.NONE,
        Actuation.NONE,
        Actuation.NONE,
        Actuation.DISC_SPRAY,
        Actuation.DISC_SPRAY,
        Actuation.NONE,
        Actuation.DISC_SPRAY,
        Actuation.NONE,
    ]
    assert plan.first_spray_between(0.0, 1.9) is None
    assert plan.first_spray_between(0.0, 2.5) == 2.0
    assert plan.first_spray_between(3.0, 3.5) == 3.0
    assert plan.first_spray_between(4.5, 13.0) == 6.0


@given(st.lists(st.floats(0.1, 1.4), min_size=2, max_size=8), st.floats(0.0, 13.0))
def test_time_is_the_integral_of_the_profile(values: list[float], at: float) -> None:
    rows = [(13.0 * i / (len(values) - 1), v) for i, v in enumerate(values)]
    plan = load_trajectory(with_speeds(*rows), VEHICLE)
    assert plan.time_at(13.0, 0) == pytest.approx(plan.total_time_s)
    # v = ds/dt: a small step takes ds / v
    v2 = 0.0
    for (s0, a), (s1, b) in itertools.pairwise(rows):
        if s0 <= at <= s1:
            v2 = a * a + (b * b - a * a) * (at - s0) / (s1 - s0)
    step = 1e-5
    if at + step < 13.0:
        taken = plan.time_at(at + step, 0) - plan.time_at(at, 0)
        assert taken == pytest.approx(step / math.sqrt(v2), rel=2e-2)
