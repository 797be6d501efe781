"""A robot that finds no way round: when it searches again, and how its job ends."""

from functools import cache
from types import SimpleNamespace
from typing import Any, NamedTuple

import pytest

from tests.way_round.met import FIELD, MARKER
from touchline.jobs.way_round.drives_report import gap_figures
from touchline.onboard.interface import TICKS_PER_S
from touchline.onboard.protection.protector import Blocked
from touchline.schemas.messages import LeftOutStretch, PlanOptions, Trajectory, TraversalStatus, WayRound
from touchline.schemas.plan_cause import PlanCause
from touchline.services.planner.plan import plan
from touchline.services.robot_sim.way_round.unpainted_lines import Gap, UnpaintedLines
from touchline.services.robot_sim.way_round.waiting import WaitingOrder
from touchline.services.robot_sim.way_round.way_round_job import (
    MOST_IN_VAIN,
    NO_WAY_ON,
    REST_LEFT_OUT,
    SKIPPED_AFTER,
    WayRoundJob,
)

SHUT_IN, NOTHING = "plan begins where the robot cannot get away", "plan has no line that can be painted"


@cache
def trajectory() -> Trajectory:
    return plan(FIELD, MARKER, PlanOptions()).trajectory


class Stuck:
    """Robot, on the first line of a job, with something in its way; and what it says."""

    def __init__(self) -> None:
        blocked = Blocked(0, 0.7, (6.0, 0.0), moving=False, too_near=False)
        self.onboard: Any = SimpleNamespace(
            state=TraversalStatus.PAUSED,
            blocked=blocked,
            estimate=Estimate(4.0, 0.0, 0.0),
            status=SimpleNamespace(arc_length_m=9.0, pause=None),
            painted=SimpleNamespace(ids=(), fractions=()),
            protection=SimpleNamespace(braking_mps2=4.0),
            perception=SimpleNamespace(tracks=[]),
            drive_problem="",
        )
        self.vehicle, self.tick_count, self.said = MARKER, 0, WayRound()
        self.job = WayRoundJob(self, FIELD, trajectory(), PlanCause(options=PlanOptions()), lambda: None)  # type: ignore[arg-type]

    def note_way_round(self, said: WayRound, warning: str = "") -> None:
        self.said = said

    def searches_after_s(self) -> float:
        """Time until it searches a way."""
        begun = self.tick_count
        while not self.job.look(attended=False):
            self.tick_count += 10
        return (self.tick_count - begun) / TICKS_PER_S

    def thing_at(self, x_m: float, *, moving: bool = False) -> None:
        self.onboard.blocked = self.onboard.blocked._replace(place_m=(x_m, 0.0), moving=moving)

    def goes_round(self, x_m: float) -> None:
        """End a drive where the robot stands now for a plan, and begin the next."""
        self.onboard.estimate = Estimate(x_m, 0.0, 0.0)
        request = self.job.rest()
        assert request is not None
        self.job.breaks_off(request, Trajectory(), ())
        self.job.drives_on(trajectory())


class Estimate(NamedTuple):
    """Pose of a standing robot."""

    x_m: float
    y_m: float
    heading_rad: float
    speed_mps: float = 0.0


@pytest.fixture
def stuck() -> Stuck:
    return Stuck()


def test_it_searches_ever_later_says_when_and_then_ends_its_job(stuck: Stuck) -> None:
    waited = [stuck.searches_after_s()]
    while not (why := stuck.job.finds_no_way(SHUT_IN)):
        assert stuck.said.state == WayRound.FINDS_NO_WAY
        waited.append(stuck.searches_after_s())
        assert stuck.said.goes_round_at.seconds <= stuck.tick_count / TICKS_PER_S
    assert waited == [2.0, 10.0, 20.0, 40.0, 80.0]
    assert why == f"{NO_WAY_ON}: {SHUT_IN}" and stuck.job.over, "a line that it has not come to is no line left out"
    assert {each.outline for each in stuck.job.left_out.stretches} == {""}


def test_it_searches_sooner_once_something_else_is_in_the_way_or_an_order_comes(stuck: Stuck) -> None:
    stuck.searches_after_s()
    for _ in range(2):
        stuck.job.finds_no_way(SHUT_IN)
        said_s, waited_s = stuck.said.goes_round_at.seconds, stuck.searches_after_s()
    assert said_s == stuck.tick_count / TICKS_PER_S and waited_s == 20.0
    stuck.job.finds_no_way(SHUT_IN)
    stuck.thing_at(9.0)
    assert stuck.searches_after_s() == 10.0
    stuck.job.finds_no_way(SHUT_IN)
    assert stuck.job.answer(WaitingOrder.GO_ROUND) == ""
    assert stuck.searches_after_s() == 0.0
    stuck.job.finds_no_way(SHUT_IN)
    assert stuck.searches_after_s() == 10.0


def test_what_stands_at_the_robot_for_good_ends_its_job_as_well(stuck: Stuck) -> None:
    stuck.onboard.blocked = stuck.onboard.blocked._replace(distance_m=0.0, too_near=True)
    waited = list[float]()
    why = ""
    while not why:
        waited.append(stuck.searches_after_s())
        assert stuck.job.rest() is None
        why = stuck.job.nothing_remains()
    assert waited == [10.0, 10.0, 20.0, 40.0, 80.0]
    assert why.startswith(NO_WAY_ON) and "too near" in why


def test_who_passes_by_does_not_hold_a_robot_for_good_beside_what_stands_at_it(stuck: Stuck) -> None:
    def passes(*, moving: bool, x_m: float = 6.0) -> None:
        stuck.onboard.blocked = Blocked(0, 0.3, (x_m, 0.0), moving=moving, too_near=True)
        for _ in range(30):
            stuck.tick_count += 10
            if stuck.job.look(attended=False):
                reasons.append(stuck.job.nothing_remains())

    reasons = list[str]()
    while not any(reasons) and stuck.tick_count < 400 * TICKS_PER_S:
        for _ in range(8):
            passes(moving=False)
        passes(moving=True, x_m=4.5)
    assert reasons[-1].startswith(NO_WAY_ON)


def test_people_who_stand_at_the_robot_by_turns_do_not_end_the_job(stuck: Stuck) -> None:
    for k in range(200):
        stuck.onboard.blocked = Blocked(0, 0.3, (6.0 + k % 2, 0.0), moving=False, too_near=True)
        for _ in range(60):
            stuck.tick_count += 10
            assert not stuck.job.look(attended=False)


def test_what_moves_does_not_end_the_job(stuck: Stuck) -> None:
    for _ in range(8):
        stuck.thing_at(6.0, moving=True)
        stuck.job.look(attended=False)
        stuck.thing_at(6.0)
        stuck.searches_after_s()
        assert not stuck.job.finds_no_way(SHUT_IN)


def test_it_waits_for_a_planner_for_good(stuck: Stuck) -> None:
    stuck.searches_after_s()
    for _ in range(8):
        assert not stuck.job.finds_no_way("no planner answers", searched=False)
        assert stuck.searches_after_s() == 10.0


def test_with_nothing_in_reach_it_looks_once_at_what_it_remembers_and_ends(stuck: Stuck) -> None:
    stuck.searches_after_s()
    assert not stuck.job.finds_no_way(NOTHING, nothing_reached=True)
    assert stuck.searches_after_s() == 0.0, "at once, as it has forgotten what it does not see"
    assert stuck.job.finds_no_way(NOTHING, nothing_reached=True) == REST_LEFT_OUT and stuck.job.over


def test_a_job_that_is_aborted_lists_all_that_is_not_painted_once_the_robot_stands(stuck: Stuck) -> None:
    stuck.onboard.state, stuck.onboard.estimate = TraversalStatus.ABORTED, Estimate(4.0, 0.0, 0.0, speed_mps=0.5)
    stuck.job.cancel()
    stuck.job.look(attended=False)
    assert not stuck.job.over, "paint may still fall"
    stuck.onboard.estimate = Estimate(4.2, 0.0, 0.0)
    stuck.job.look(attended=False)
    assert stuck.job.over and [each.length_m for each in stuck.said.left_out] == [12.0, 12.0]
    (first, _) = gap_figures(stuck.said.left_out, "aborted by the operator")["stretches"]
    assert first["reason"] == "not painted: aborted by the operator"


def test_ways_round_that_end_elsewhere_are_not_in_vain(stuck: Stuck) -> None:
    for k in range(MOST_IN_VAIN + 1):
        stuck.goes_round(-8.0 - 2.0 * k)
    for _ in range(MOST_IN_VAIN - 1):
        stuck.goes_round(-8.5)
    assert stuck.job.rest() is None
    assert stuck.job.nothing_remains().startswith(NO_WAY_ON)


def test_a_part_of_a_line_to_which_ways_round_do_not_come_is_skipped_until_it_comes_back(stuck: Stuck) -> None:
    for _ in range(SKIPPED_AFTER):
        stuck.goes_round(4.0)
    request = stuck.job.rest()
    assert request is not None
    assert [each.id for each in request.rest.template.segments] == ["s0 (1)", "s0 (2)", "s1"]
    assert stuck.job.nothing_remains() == "", "it comes back for that first"
    request = stuck.job.rest()
    assert request is not None and [each.id for each in request.rest.template.segments] == ["s0", "s1"]


@pytest.mark.parametrize(("to_m", "unexplained"), [(5.0, True), (7.0, False)])
def test_a_gap_is_explained_by_what_was_left_out_of_most_of_it(to_m: float, *, unexplained: bool) -> None:
    lines = UnpaintedLines(FIELD, MARKER, [Gap("s0", 0.0, to_m, "post 1"), Gap("s1", 0.0, 12.0, "post 1")])
    assert lines.unexplained == unexplained


def test_what_a_plan_leaves_out_is_tried_again_only_once_the_robot_comes_back(stuck: Stuck) -> None:
    request = stuck.job.rest()
    assert request is not None
    stuck.job.breaks_off(request, Trajectory(), [LeftOutStretch(line_id="s0", outline="post 1", from_m=0.0, to_m=12.0)])
    stuck.job.drives_on(trajectory())
    request = stuck.job.rest()
    assert request is not None and [each.id for each in request.rest.template.segments] == ["s1"]
    assert not stuck.job.finds_no_way(NOTHING, nothing_reached=True)
    request = stuck.job.rest()
    assert request is not None and [each.id for each in request.rest.template.segments] == ["s0", "s1"]
