"""Handover of robots between regions: whatever is lost and whoever crashes, others keep off where a robot may be."""

from __future__ import annotations

import numpy as np
import pytest

from tests.plan_limits import LIMITS
from tests.regions.two_regions import (
    PLACES,
    ROBOT,
    STEPS,
    OnceOnly,
    Robot,
    TwoRegions,
    Unasked,
    Unfenced,
)
from touchline.coordination.regions.region import Region
from touchline.coordination.regions.region_borders import RegionBorders, halo_m, reach_m
from touchline.coordination.regions.region_codec import decode_bundle, encode_bundle
from touchline.coordination.regions.region_messages import (
    ClaimsAnswer,
    Letter,
    OwnedState,
    OwnerOrder,
    PlanOrder,
    RegionLife,
    RobotClaims,
    TimedPlan,
)
from touchline.core.timed_motion import COLUMNS
from touchline.onboard.executive.owner_fence import OwnerFence

MOST_ROUNDS = 2000


@pytest.mark.parametrize(
    ("seed", "handovers"), [(1, 400), *(pytest.param(s, 2000, marks=pytest.mark.full) for s in range(3, 8))]
)
def test_what_a_robot_follows_is_claimed_in_both_regions_whoever_crashes(seed: int, handovers: int) -> None:
    course = TwoRegions(seed).run(handovers, MOST_ROUNDS)
    assert course.handovers == handovers
    assert course.astray == 0
    assert not course.never
    assert min(course.crashes[step] for step in STEPS) > 0, course.crashes
    assert np.quantile(course.stood, 0.99) < 80


def test_the_same_where_regions_crash_every_ten_seconds() -> None:
    regions = TwoRegions(11)
    regions.crashes = 0.01
    course = regions.run(250, MOST_ROUNDS)
    assert (course.handovers, course.astray, course.never) == (250, 0, False)


@pytest.mark.parametrize(("region", "robot"), [(Unasked, Robot), (Region, Unfenced)], ids=["claim", "fence"])
def test_with_a_rule_left_out_a_robot_is_where_others_do_not_keep_off(region: type[Region], robot: type[Robot]) -> None:
    assert TwoRegions(1, region, robot).run(250, MOST_ROUNDS).astray > 0


def test_if_owner_is_sent_once_a_robot_stands_for_ever() -> None:
    assert TwoRegions(1, OnceOnly).run(400, MOST_ROUNDS).never


def test_a_robot_obeys_the_owner_of_the_highest_epoch_alone() -> None:
    fence = OwnerFence()
    assert fence.take("a", 1)
    assert fence.take("a", 1)
    assert fence.take("b", 2)
    assert not fence.take("a", 1)
    assert not fence.take("c", 2)
    assert not fence.obeys("b", 1)
    assert fence.obeys("b", 2)


def plan(branch_s: float = 9.0) -> TimedPlan:
    return TimedPlan(np.zeros((2, COLUMNS)), 0.0, branch_s)


def pair(numbers: tuple[int, int]) -> tuple[Region, Region]:
    """Two regions with a robot each, whose new plans, after these numbers, come too near to each other."""
    regions: list[Region] = []
    for which, name in enumerate("ab"):
        places = PLACES._replace(neighbours=frozenset((1 - which,)))

        def all_proposals(robot: str, plan: TimedPlan, which: int = which) -> list[tuple[str, int]]:
            own = regions[which].own
            return [(each, known.proposal) for each, known in own.items() if known.proposal is not None]

        region = Region(RegionLife(which, 1), 0.0, places, ("a", "b"), all_proposals)
        regions.append(region)
        for other, number in zip("ab", numbers, strict=True):
            owner = RegionLife("ab".index(other), 1)
            region.hear(OwnedState(other, 1.0, owner, 1, number, number, plan()))
        assert name in region.own
    for _ in range(3):
        carry(regions[0], regions[1])
    assert regions[0].ready
    assert regions[1].ready
    return regions[0], regions[1]


def carry(one: Region, other: Region) -> list[ClaimsAnswer]:
    """Carry all letters over, and the answers back."""
    letters, answers = [*one.letters(), *other.letters()], []
    for letter in letters:
        receiver, sender = (other, one) if letter.to == other.name.region else (one, other)
        for answer in receiver.receive(letter):
            sender.receive(answer)
            answers.append(answer.message)
    return [each for each in answers if isinstance(each, ClaimsAnswer)]


@pytest.mark.parametrize(("numbers", "stays"), [((3, 3), "a"), ((4, 3), "b"), ((3, 4), "a")])
def test_of_two_proposals_that_come_too_near_the_lower_one_stays(numbers: tuple[int, int], stays: str) -> None:
    one, other = pair(numbers)
    one.propose("a", plan())
    other.propose("b", plan())
    carry(one, other)
    open_now = {robot for region in (one, other) for robot, own in region.own.items() if own.proposal is not None}
    assert open_now == {stays}
    carry(one, other)
    orders = [*one.orders(), *other.orders()]
    assert [(each.robot, type(each)) for each in orders] == [(stays, PlanOrder)]


def test_a_plan_that_has_been_sent_is_not_withdrawn_for_another() -> None:
    one, other = pair((5, 3))
    one.propose("a", plan())
    carry(one, other)
    assert len(one.orders()) == 1
    other.propose("b", plan())
    carry(one, other)
    assert one.own["a"].proposal == 6
    assert other.own["b"].proposal is None


def test_old_claims_and_those_of_an_ended_life_count_for_nothing() -> None:
    _, other = pair((3, 3))
    newer, older = RobotClaims("a", 2, 1, {7: plan()}), RobotClaims("a", 1, 9, {6: plan()})
    assert other.receive(Letter(RegionLife(0, 2), 1, newer))
    assert not other.receive(Letter(RegionLife(0, 2), 1, older))
    assert not other.receive(Letter(RegionLife(0, 1), 1, RobotClaims("a", 3, 1, {8: plan()})))
    assert list(other.foreign["a"].plans) == [7]


def test_a_region_that_begins_anew_owns_its_robots_in_a_new_epoch_before_it_plans() -> None:
    region = Region(RegionLife(0, 5), 2.0, PLACES._replace(neighbours=frozenset()), (ROBOT,), lambda robot, plan: ())
    state = OwnedState(ROBOT, 1.9, RegionLife(0, 5), 8, 3, 4, plan())
    region.hear(state)  # from before it began
    assert not region.ready
    region.hear(state._replace(stamp_s=2.1, owner=RegionLife(0, 4)))
    assert region.orders() == [OwnerOrder(ROBOT, RegionLife(0, 5), 9)]
    assert not region.ready
    region.hear(state._replace(stamp_s=2.2, epoch=9))
    assert region.free(ROBOT)
    assert not region.orders()


def test_borders_and_halos() -> None:
    assert reach_m(LIMITS) == pytest.approx(0.45)
    assert halo_m(LIMITS) == pytest.approx(1.4)
    borders = RegionBorders((0.0, 10.0, 20.0), (0.0, 10.0, 20.0), halo_m(LIMITS))
    assert [borders.at(*place) for place in ((1.0, 1.0), (12.0, 1.0), (1.0, 12.0), (25.0, 25.0))] == [0, 1, 2, 3]
    assert borders.near(5.0, 5.0) == {0}
    assert borders.near(9.0, 5.0) == {0, 1}
    assert borders.near(9.5, 9.5) == {0, 1, 2, 3}
    assert borders.near(9.0, 8.9) == {0, 1, 2}
    assert borders.neighbours(0) == {1, 2, 3}


def test_messages_are_the_same_after_their_way_over_the_bus() -> None:
    new, old = (TimedPlan(np.arange(10.0).reshape(-1, COLUMNS) + k, 0.4 * k, 0.4 * k + 0.3) for k in range(2))
    claims = RobotClaims("a", 3, 7, {4: old, 5: new})
    state = OwnedState("a", 1.5, RegionLife(1, 2), 3, 4, 5, old)
    sent = [Letter(RegionLife(0, 1), 1, claims), (state, 2.0, None), PlanOrder("a", RegionLife(1, 2), 3, 5, 4, new)]
    letter, (again, x_m, nothing), order = decode_bundle(encode_bundle(sent))
    assert (letter.sender, letter.to, letter.message[:3]) == (RegionLife(0, 1), 1, ("a", 3, 7))
    assert isinstance(letter.message, RobotClaims)
    assert (again[:6], x_m, nothing, order[:5]) == (state[:6], 2.0, None, sent[2][:5])
    for mine, theirs in ((old, letter.message.plans[4]), (new, letter.message.plans[5]), (old, again.plan)):
        assert (theirs.samples == mine.samples).all()
        assert (theirs.start_s, theirs.branch_s) == (mine.start_s, mine.branch_s)
    assert order.plan is letter.message.plans[5]
    assert decode_bundle(encode_bundle([])) == []
