"""Committed plans: no two are ever nearer than 2·r_s, whatever robots wish; and who wishes well arrives soon."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.plan_limits import LIMITS
from touchline.coordination.algorithms.team_algorithm import GoalWish, VelocityWish
from touchline.coordination.free_area import FreeArea
from touchline.coordination.plans import barrier_kernels, committed_plans
from touchline.coordination.plans import plan_kernels as kernels
from touchline.coordination.plans.barrier_plans import BarrierPlans
from touchline.coordination.plans.committed_plans import CommittedPlans, TooNear
from touchline.core import timed_motion as t

Floats = NDArray[np.float64]

ROOM = FreeArea.of([(0, 0), (5, 0), (5, 4), (0, 4)], [[(2, 1.5), (3, 1.5), (3, 2.5), (2, 2.5)]])
PERIOD_S = 0.4
ROUNDING_M = 1e-9


def scattered(rng: np.random.Generator, count: int) -> Floats:
    """Poses in the room, as near to each other and to walls as plans may be."""
    poses: list[tuple[float, float, float]] = []
    while len(poses) < count:
        x, y, heading = rng.uniform((0, 0, -math.pi), (5, 4, math.pi)).tolist()
        free = all(math.hypot(x - a, y - b) >= LIMITS.apart_m for a, b, _ in poses)
        if free and ROOM.holds(np.array([(x, y)]), LIMITS.wall_m).all():
            poses.append((x, y, heading))
    return np.array(poses)


def wall_clearance_m(plans: Floats) -> float:
    """The least distance of all samples of plans from the room's border."""
    import shapely

    places = plans[:, :, :2].reshape(-1, 2)
    assert ROOM.holds(places, 0.0).all()
    return float(shapely.distance(ROOM.shape.boundary, shapely.points(places)).min())


def at_nearest(places: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Wishes of robots that all drive at whoever is nearest, as fast as they can."""
    apart = np.abs(places[:, None] - places) + np.diag(np.full(len(places), np.inf))
    way = places[apart.argmin(axis=1)] - places
    wishes: NDArray[np.complex128] = way / np.abs(way)
    return wishes


@pytest.mark.parametrize("malicious", [False, True], ids=["random", "at the nearest"])
def test_no_wish_brings_plans_nearer_than_they_may_be_by_barriers(malicious: bool) -> None:
    rng, changed_mps = np.random.default_rng(8), 0.0
    for _ in range(4):
        team = BarrierPlans(scattered(rng, 14), ROOM, LIMITS)
        for _ in range(40):
            before = team.plans.copy()
            wishes = at_nearest(team.places) if malicious else rng.normal(size=14) + 1j * rng.normal(size=14)
            team.choose_by(wishes, range(14))
            assert team.closest_m >= LIMITS.apart_m - ROUNDING_M
            assert wall_clearance_m(team.plans) >= LIMITS.wall_m - ROUNDING_M
            np.testing.assert_array_equal(team.plans[:, 0], before[:, LIMITS.drive_steps])
            changed_mps += float(np.abs(team.changes[:, 0]).sum())
        assert team.infeasible == 0
    assert changed_mps > 10.0


def test_barriers_grant_the_wish_of_a_robot_that_is_alone() -> None:
    team = BarrierPlans(np.array([(1.0, 3.0, 0.0)]), ROOM, LIMITS)
    for _ in range(5):
        team.choose_by(np.array([0.4 + 0.0j]), [0])
        assert not team.changes.any()
    assert team.plans[0, LIMITS.drive_steps, t.SPEED] == pytest.approx(0.4)


def test_braking_is_what_is_left_of_a_plan_by_barriers() -> None:
    rng = np.random.default_rng(4)
    team = BarrierPlans(scattered(rng, 6), ROOM, LIMITS)
    for _ in range(10):
        team.choose_by(at_nearest(team.places), range(6))
        rest = team.plans.copy()
        kernels.advance(rest, LIMITS.drive_steps)
        braking = rest.copy()
        barrier_kernels.roll_out_all(braking, np.zeros((6, 2)), LIMITS)
        np.testing.assert_allclose(braking, rest, atol=1e-12)


@pytest.mark.parametrize("certain", [True, False])
@pytest.mark.parametrize("kind", [CommittedPlans, BarrierPlans])
def test_a_robot_that_stays_keeps_its_plan_and_others_keep_off_it(kind: type[CommittedPlans], certain: bool) -> None:
    """It drives ahead of another one, which would push it on."""
    team = kind(np.array([(0.5, 3.0, 0.0), (1.0, 3.0, 0.0)]), ROOM, LIMITS, certain=certain)
    for update in range(15):
        rest, staying = team.plans[1:].copy(), [1] if update >= 3 else []
        kernels.advance(rest, LIMITS.update_steps)
        team.update([VelocityWish(0.5, 0.0)] * 2, staying)
        assert team.closest_m >= LIMITS.apart_m - ROUNDING_M
        if staying:
            np.testing.assert_array_equal(team.plans[1], rest[0])
            assert not team.proposed[1]
        for who in np.flatnonzero(team.proposed).tolist():
            team.settle(who, follows=True)
    assert team.places[1].real > 1.1
    assert team.closest_m < LIMITS.apart_m + 0.1


def test_others_take_a_robot_that_stays_for_one_that_stands() -> None:
    room = FreeArea.of([(0, 0), (5, 0), (5, 4), (0, 4)])
    wishes = [VelocityWish(0.0, 0.0), VelocityWish(0.0, 0.5)]
    team = CommittedPlans(np.array([(1.0, 2.0, 0.0), (1.5, 1.2, math.pi / 2.0)]), room, LIMITS)
    for update in range(8):
        team.update(wishes, [1] if update >= 3 else [])
    anew = CommittedPlans(team.plans[:, 0, :3], room, LIMITS)
    for each in (team, anew):
        each.update([GoalWish(4.5, 2.0), wishes[1]], [1])
    assert team.plans[1, 0, t.Y] > 1.3
    np.testing.assert_allclose(team.plans[0], anew.plans[0], atol=1e-12)


@pytest.mark.parametrize("malicious", [False, True], ids=["random", "at the nearest"])
def test_no_wish_brings_plans_nearer_than_they_may_be(malicious: bool) -> None:
    rng = np.random.default_rng(7)
    moved_m = 0.0
    for _ in range(6):
        team = CommittedPlans(scattered(rng, 14), ROOM, LIMITS)
        for _ in range(40):
            before, places = team.plans.copy(), team.places
            wishes = at_nearest(places) if malicious else rng.normal(size=14) + 1j * rng.normal(size=14)
            team.choose_by(wishes, rng.permutation(14)[: rng.integers(15)].tolist())
            assert team.closest_m >= LIMITS.apart_m - ROUNDING_M
            assert wall_clearance_m(team.plans) >= LIMITS.wall_m - ROUNDING_M
            np.testing.assert_array_equal(team.plans[:, 0], before[:, LIMITS.drive_steps])  # nobody jumps
            moved_m += float(np.abs(team.places - places).sum())
    assert moved_m > 20.0


def test_plans_of_others_lead_through_a_robot_that_stops_where_its_plan_does_not() -> None:
    """The reason why faults with which robots leave their plans are refused."""
    team, nearest_m = CommittedPlans(scattered(np.random.default_rng(7), 14), ROOM, LIMITS), math.inf
    for _ in range(20):
        team.choose_by(at_nearest(team.places)[::-1], range(14))
        now, later = team.places, team.plans[:, :, t.X] + 1j * team.plans[:, :, t.Y]
        apart = np.abs(now[:, None, None] - later) + np.diag(np.full(14, np.inf))[:, :, None]
        nearest_m = min(nearest_m, float(apart.min()))
    assert nearest_m < 0.5 * LIMITS.apart_m


def test_the_rest_of_every_plan_stays_permitted() -> None:
    rng = np.random.default_rng(3)
    team, around = CommittedPlans(scattered(rng, 14), ROOM, LIMITS), kernels.AreaBorders(ROOM.sides, ROOM.walls)
    for _ in range(40):
        team.choose_by(at_nearest(team.places), range(14))
        rests = team.plans.copy()
        claims = kernels.Claims(rests, np.arange(14))
        for steps in range(1, rests.shape[1]):
            kernels.advance(rests, 1)
            assert all(kernels.first_conflict(plan, who, claims, LIMITS) < 0 for who, plan in enumerate(rests)), steps
            assert all(kernels.clear_of_walls(plan, around, LIMITS) for plan in rests)
        assert not rests[:, 0, t.SPEED :].any()  # by then all stand


def test_a_plan_changes_speed_and_yaw_rate_no_faster_than_it_may_and_ends_at_rest() -> None:
    rng = np.random.default_rng(5)
    for _ in range(200):
        plan = np.zeros((kernels.samples_of(LIMITS), t.COLUMNS))
        plan[0, t.SPEED :] = rng.uniform((0.0, -2.0), (0.5, 2.0))
        speed, rate = kernels.primitive(plan[0], int(rng.integers(kernels.PRIMITIVES)), 1.0, LIMITS)
        kernels.roll_out(plan, speed, rate, LIMITS, len(plan))
        assert np.abs(np.diff(plan[:, t.SPEED])).max() <= LIMITS.acceleration_mps2 * t.STEP_S + 1e-12
        assert np.abs(np.diff(plan[:, t.YAW_RATE])).max() <= LIMITS.yaw_acceleration_radps2 * t.STEP_S + 1e-12
        assert plan[LIMITS.drive_steps, t.SPEED] == pytest.approx(speed)
        assert not plan[-1, t.SPEED :].any()
        assert abs(rate) * max(speed, plan[0, t.SPEED]) <= LIMITS.lateral_acceleration_mps2 + 1e-12


def test_the_distance_of_plans_is_that_of_their_motions_at_any_time() -> None:
    rng = np.random.default_rng(11)
    for _ in range(50):
        pair = np.zeros((2, kernels.samples_of(LIMITS), t.COLUMNS))
        for plan in pair:
            plan[0] = rng.uniform((0, 0, -3, 0, -1), (1, 1, 3, 0.5, 1))
            kernels.roll_out(plan, rng.uniform(0.0, 0.5), rng.uniform(-2.0, 2.0), LIMITS, len(plan))
        one, other, least = np.zeros(5), np.zeros(5), math.inf
        for time_s in np.linspace(0.0, (pair.shape[1] - 1) * t.STEP_S, 3000):
            t.motion_at(pair[0], time_s, one)
            t.motion_at(pair[1], time_s, other)
            least = min(least, math.hypot(one[0] - other[0], one[1] - other[1]))
        exact = math.sqrt(kernels.apart_squared_of(pair[0], pair[1], 0.0))
        assert exact <= least + 1e-12
        assert exact == pytest.approx(least, abs=2e-4)


def on_circle(count: int, seed: int) -> Floats:
    """Poses of robots that change places, 0.8 m apart, each slightly off its even place."""
    rng = np.random.default_rng(seed)
    angle = math.tau * (np.arange(count) + rng.uniform(-0.05, 0.05, count)) / count
    radius_m = max(1.5, 0.8 * count / math.tau)
    heading = rng.uniform(-math.pi, math.pi, count)
    return np.column_stack((radius_m * np.cos(angle), radius_m * np.sin(angle), heading))


def swapped(count: int, seed: int) -> tuple[float, float]:
    """Duration of a swap over the straight-line bound, and the least distance of plans (m)."""
    poses = on_circle(count, seed)
    side_m = float(np.abs(poses[:, :2]).max()) + 1.0
    area = FreeArea.of([(-side_m, -side_m), (side_m, -side_m), (side_m, side_m), (-side_m, side_m)])
    team, goals = CommittedPlans(poses, area, LIMITS), 2.0 * poses[:, :2].mean(axis=0) - poses[:, :2]
    bound_s = float(np.hypot(*(goals - poses[:, :2]).T).max()) / LIMITS.speed_max_mps + 1.0
    closest_m, now_s = math.inf, 0.0
    while np.abs(team.places - (goals[:, 0] + 1j * goals[:, 1])).max() > 0.1:
        assert now_s < 4.0 * bound_s, "somebody never arrives"
        team.update([GoalWish(x, y) for x, y in goals.tolist()])
        closest_m, now_s = min(closest_m, team.closest_m), now_s + PERIOD_S
    return now_s / bound_s, closest_m


def test_twenty_robots_change_places_in_half_as_long_again_as_alone() -> None:
    runs = [swapped(20, seed) for seed in range(100, 109)]
    assert np.median([factor for factor, _ in runs]) <= 1.5
    assert min(closest_m for _, closest_m in runs) >= LIMITS.apart_m - ROUNDING_M


def test_who_stands_in_the_way_of_one_that_waits_is_pushed_on_and_the_token_goes_round() -> None:
    corridor = FreeArea.of([(0, 0), (6, 0), (6, 0.7), (0, 0.7)])
    team = CommittedPlans(np.array([(0.5, 0.35, 0.0), (1.5, 0.35, 0.0)]), corridor, LIMITS)
    goals, holders, farthest_m = np.array([(5.0, 0.35), (1.5, 0.35)]), set(), 0.0
    for _ in range(100):
        team.update([GoalWish(x, y) for x, y in goals.tolist()])
        holders.add(team.token)
        farthest_m = max(farthest_m, team.places[1].real)
        assert team.closest_m >= LIMITS.apart_m - ROUNDING_M
    assert {-1, 0} <= holders
    assert farthest_m > 1.8


def token_places() -> tuple[int, list[float]]:
    """Updates until a robot gets the token, that another one at its goal shuts out, and its places while it has it."""
    corridor = FreeArea.of([(0, 0), (8, 0), (8, 0.7), (0, 0.7)])
    team = CommittedPlans(np.array([(0.5, 0.35, 0.0), (1.5, 0.35, 0.0)]), corridor, LIMITS)
    goals, found, updates = np.array([(7.5, 0.35), (1.5, 0.35)]), list[float](), 0
    for _ in range(100):
        team.update([GoalWish(x, y) for x, y in goals.tolist()])
        updates += not found
        if team.token == 0:
            found.append(team.places[0].real)
        elif found:
            break
    return updates, found


def test_who_is_shut_out_by_one_at_its_goal_gets_the_token_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    soon, _ = token_places()
    monkeypatch.setattr(committed_plans, "_SOON_S", math.inf)
    late, _ = token_places()
    assert (late - soon) * PERIOD_S >= 1.5


def test_a_robot_that_stays_gives_the_token_back_and_gets_none() -> None:
    corridor = FreeArea.of([(0, 0), (8, 0), (8, 0.7), (0, 0.7)])
    team = CommittedPlans(np.array([(0.5, 0.35, 0.0), (1.5, 0.35, 0.0)]), corridor, LIMITS)
    wishes = [GoalWish(7.5, 0.35), GoalWish(1.5, 0.35)]
    while team.token != 0:
        team.update(wishes)
    for _ in range(20):
        team.update(wishes, [0])
        assert team.token == -1
    team.update(wishes)
    assert team.token == -1


def test_the_token_is_given_back_past_the_jam(monkeypatch: pytest.MonkeyPatch) -> None:
    _, places = token_places()
    assert 0.3 <= places[-1] - places[0] <= 0.8
    monkeypatch.setattr(committed_plans, "_FREED_M", math.inf)
    _, places = token_places()
    assert places[-1] - places[0] > 1.0


@pytest.mark.parametrize(("poses", "whose"), [([(1, 1, 0), (1.39, 1, 0)], "two robots"), ([(0.19, 1, 0)], "wall")])
def test_robots_that_stand_too_near_at_the_start_are_refused(poses: list[tuple[float, ...]], whose: str) -> None:
    with pytest.raises(TooNear, match=whose):
        CommittedPlans(np.array(poses, dtype=np.float64), ROOM, LIMITS)
