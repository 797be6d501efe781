"""Job whose robot waits for what is in its way, goes round it, and comes back once to what it left out."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from functools import partial
from typing import Final, NamedTuple

import numpy as np

from touchline.onboard.interface import TICKS_PER_S
from touchline.onboard.perception.perception import lidars_of
from touchline.onboard.protection.protector import Blocked
from touchline.schemas.line_parts import DONE_M
from touchline.schemas.messages import LeftOutStretch, Time, Trajectory, TraversalStatus
from touchline.schemas.messages import WayRound as Said
from touchline.schemas.plan_cause import PlanCause
from touchline.schemas.standing_clearance import standing_clearance_m
from touchline.schemas.template import Polygon, Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import UNDER_WAY, Emulator
from touchline.services.robot_sim.settling import RESTING_MPS
from touchline.services.robot_sim.way_round.remains import OPERATOR, PLAN, LeftOut, Remains, Rest
from touchline.services.robot_sim.way_round.rest_request import Pose, RestRequest, passing_m, with_margin
from touchline.services.robot_sim.way_round.seen_things import SeenThings, seen_things, thing_in_the_way
from touchline.services.robot_sim.way_round.swath_lines import with_swaths_as_lines
from touchline.services.robot_sim.way_round.uncovered_ground import UncoveredGround
from touchline.services.robot_sim.way_round.unpainted_lines import UnpaintedLines
from touchline.services.robot_sim.way_round.waiting import PATIENT, Waiting, WaitingOrder

AGAIN_TICKS: Final = 10 * TICKS_PER_S
"""Ticks after which a way round is searched again where there was none, or where the last one was blocked at once."""
LONGEST_TICKS: Final = 80 * TICKS_PER_S
"""Longest wait for that: it is twice as long after each search without a way."""
MOST_REFUSALS: Final = 4
"""Searches without a way in a row, before something that does not move, after which the job ends with the next one."""
CHANGED_M: Final = 0.5
"""Distance of what is in the way from where it was at each search from which the next one is not put off."""
ADVANCED_M: Final = 0.3
"""Way on a drive up to which it counts as blocked at once."""
REST_LEFT_OUT: Final = "what was left out cannot be reached"
"""Reason for which the robot itself ends a job that is done but for that."""
NO_WAY_ON: Final = "finds no way on"
"""Reason for which it ends one of which there remains what it has not tried to reach."""
SOON_S: Final = 1.0
"""Change of the time at which it goes round up to which that is not reported."""
SKIPPED_AFTER: Final = 3
"""Ways round without new work that end where an earlier one did, after which the next part of a line is skipped;"""
MOST_IN_VAIN: Final = 4
"""and after which the job ends, if there is none."""
MOST_WITHOUT_WORK: Final = 20
"""Ways round in a row without new work, wherever they end, after which it ends, too."""
SAME_PLACE_M: Final = 1.0
"""Distance of places at which ways round end up to which they count as the same."""
WIDER_M: Final = 0.2
NEAR_WIDER_M: Final = 0.05
"""Distances by which the robot keeps farther off things after each, and off those beside which it stands."""


def goes_round(vehicle: Vehicle, template: Template | None) -> bool:
    """Return whether a robot goes round things on a job: it has a lidar, and the job has a template."""
    return template is not None and bool(lidars_of(vehicle))


class RestDraft(NamedTuple):
    """Place and surroundings of the robot for a plan of the rest.

    Attributes:
        pose: Pose of the standing robot.
        seen: What it has seen, with the distance that it keeps.
        things: Name of what is in its way.
        rest: Works out the rest, in any thread: that takes a moment.
    """

    pose: Pose
    seen: tuple[Polygon, ...]
    things: tuple[str, ...]
    rest: Callable[[], Rest | None]


class WayRoundJob:
    """Behaviour of a robot that meets things on a job of lines or areas.

    The owner calls `look` between ticks, plans and loads what it asks for, and reports the outcome.

    Args:
        emulator: The robot, which has taken the job.
        template: The job.
        trajectory: Its plan.
        cause: Inputs of the plan.
        told: Called after each report, to publish it.

    Attributes:
        remains: What is not done, by the robot's own record.
        over: True once the robot neither goes round anything nor comes back.
        finished: True if it has done all that it can reach.
    """

    def __init__(
        self,
        emulator: Emulator,
        template: Template,
        trajectory: Trajectory,
        cause: PlanCause,
        told: Callable[[], None],
    ) -> None:
        self._emulator, self._options, self._told = emulator, cause.options, told
        self._trajectory, self._waiting, self._seen = trajectory, Waiting(PATIENT), SeenThings()
        vehicle = emulator.vehicle
        self.remains: Remains = (
            UncoveredGround(template, vehicle, cause.options, cause.remaining)
            if template.areas and vehicle.tool.covers
            else UnpaintedLines(with_swaths_as_lines(template, trajectory, vehicle), vehicle)
        )
        self.remains.note_plan(trajectory)
        known = [*([template.boundary] if template.boundary else []), *template.obstacles]
        self._for_good = {OPERATOR, PLAN, *(outline.id for outline in known)}
        self._search_tick, self._in_vain, self._work_done, self._stops = 0, 0, 0.0, list[tuple[float, float]]()
        self._unheld_tick, self._held_at = 0, (math.inf, math.inf)
        self._refusals, self._refused_tick, self._refused_at = 0, 0, list[tuple[float, float]]()
        self.over = self.finished = self._returning = self._breaks_off = False
        self._order = WaitingOrder.GO_ROUND
        self._drives, self._counted, self._passed = 1, 0, tuple[str, ...]()
        self._said, self._warned = Said(), ""
        self._say(Said.DRIVES)

    def look(self, *, attended: bool) -> bool:
        """Look at what is in the way; return True if the rest is to be planned now, by `rest`.

        Args:
            attended: True if an operator can answer.
        """
        emulator, onboard = self._emulator, self._emulator.onboard
        if self.over:
            return False
        if onboard.state not in UNDER_WAY:
            final = onboard.state == TraversalStatus.DONE or self._stands
            if final and not (self.between_drives or self._comes_back):
                self._end()
            return False
        blocked = onboard.blocked
        order = self._waiting.look(emulator.tick_count, blocked, attended=attended)
        self._watch_for_change(blocked if self.waits else None)
        if not self.waits:
            self._unheld_tick = emulator.tick_count
            if (self._said.state, self._said.things) != (Said.DRIVES, self._passed):
                self._say(Said.DRIVES, self._passed)
            return False
        if not self._stands or blocked is None:
            return False
        if self._said.state != Said.FINDS_NO_WAY or emulator.tick_count >= self._search_tick:
            until_tick = 0 if blocked.too_near else self._waiting.until_tick(attended=attended)
            self._say(Said.WAITS, self._in_the_way, until_tick)
        else:
            self._say(Said.FINDS_NO_WAY, self._said.things, self._search_tick)
        if self._waiting.answer is None and self._drives > 1 and onboard.status.arc_length_m < ADVANCED_M:
            self._search_tick = max(self._search_tick, self._waiting.begun_tick + AGAIN_TICKS)
        self._order = order or WaitingOrder.GO_ROUND
        elsewhere = not blocked.moving and math.dist(blocked.place_m, self._held_at) > CHANGED_M
        if not blocked.too_near or elsewhere:
            self._unheld_tick, self._held_at = emulator.tick_count, blocked.place_m
        held = blocked.too_near and emulator.tick_count < self._unheld_tick + AGAIN_TICKS
        return order is not None and self.may_search and not held

    def _watch_for_change(self, blocked: Blocked | None) -> None:
        """Put the next search off no longer if the way is free, something moves, or something else is in the way.

        Who passes by a robot that may not move at all changes nothing: it is held by what stands there.
        """
        if not self._refused_at or (blocked is not None and blocked.moving and blocked.too_near):
            return
        moves = blocked is None or blocked.moving
        if moves:
            self._refusals = 0
        elsewhere = blocked is not None and all(
            math.dist(blocked.place_m, place) > CHANGED_M for place in self._refused_at
        )
        if blocked is not None and elsewhere:
            self._refused_at.append(blocked.place_m)
        if moves or elsewhere:
            self._search_tick = min(self._search_tick, self._refused_tick + AGAIN_TICKS)

    @property
    def may_search(self) -> bool:
        """True if it is time to plan the rest, and the robot knows where it stands."""
        return self._emulator.tick_count >= self._search_tick and not self._emulator.onboard.drive_problem

    @property
    def between_drives(self) -> bool:
        """True while a drive has ended for the next one, which the robot has not taken yet."""
        return self._breaks_off and not self.over and self._emulator.onboard.state not in UNDER_WAY

    def answer(self, order: WaitingOrder) -> str:
        """Take an operator's answer; return why it is refused, "" if it is not."""
        if self.over or not self.waits or self._emulator.onboard.state not in UNDER_WAY:
            return "the robot does not wait before anything"
        self._waiting.answer, self._search_tick, self._refusals = order, self._emulator.tick_count, 0
        return ""

    def rest(self) -> RestRequest | None:
        """Return the request to plan what remains from where the robot stands; None if nothing does, or in vain."""
        draft = self.draft()
        return None if draft is None else self.request(draft, draft.rest())

    def draft(self) -> RestDraft | None:
        """Return the draft of a request, for `request` once its rest is worked out; None if it were in vain."""
        onboard, vehicle = self._emulator.onboard, self._emulator.vehicle
        if self._held:
            return None
        self._enter()
        self._count_stop()
        if self._goes_in_vain:
            return None
        pose, kept_m = onboard.estimate[:3], passing_m(vehicle, onboard.protection.braking_mps2)
        kept_m += self.remains.clearances.far_side_m + WIDER_M * self._in_vain
        things = self._seen.look(onboard, self.remains.template.obstacles)
        near_m = NEAR_WIDER_M * self._in_vain
        seen = with_margin(things, pose, vehicle, kept_m, self.remains.clearances.left_m, near_m)
        if not self.remains.template.areas:  # of areas, plans keep off by themselves
            known = self.remains.template.obstacles
            seen += with_margin(known, pose, vehicle, standing_clearance_m(vehicle), self.remains.clearances.left_m)
        names = _names(thing_in_the_way(onboard, things))
        return RestDraft(pose, seen, names, partial(self.remains.rest, self._for_good, seen))

    def _count_stop(self) -> None:
        """Count a stop under way, once, if the drive before it was in vain; skip the next part of a line after some.

        A plan leads to that, but protection does not let the robot.
        """
        onboard = self._emulator.onboard
        if self._counted == self._drives or onboard.state not in UNDER_WAY:
            return
        work_done = self.remains.done
        if work_done > self._work_done + DONE_M:
            self._in_vain, self._stops = 0, []
        x, y = onboard.estimate[:2]
        self._in_vain += any(math.dist((x, y), place) < SAME_PLACE_M for place in self._stops)
        self._stops.append((x, y))
        self._work_done, self._counted = work_done, self._drives
        if self._in_vain >= SKIPPED_AFTER:
            names = _listed(self._in_the_way)
            if self.remains.skip(self._trajectory, onboard.status.arc_length_m, (x, y), names):
                self._in_vain, self._stops = 0, []

    def request(self, draft: RestDraft, rest: Rest | None) -> RestRequest | None:
        """Return the request of a draft; None if nothing remains.

        Args:
            draft: The draft.
            rest: Its rest.
        """
        if rest is None:
            return None
        if self._emulator.onboard.state in UNDER_WAY:
            self._say(Said.PLANS, draft.things)
        margin_m = self._options.margin_m if self.remains.template.areas else 0.0
        start = np.array(draft.pose)
        options = self._options.model_copy(update={"start": start, "obstructed": "", "margin_m": margin_m})
        return RestRequest(rest, draft.seen, options)

    def finds_no_way(self, reason: str, *, searched: bool = True, nothing_reached: bool = False) -> str:
        """Note that there is no plan of the rest; return the reason to abort the drive with, "" to wait on.

        The robot waits on and searches again later. If there is no work within reach of all that it remembers, it comes
        back for it, and ends its job once there is none within reach of what it sees then. It ends it, too, after some
        searches in a row.

        Args:
            reason: Why there is none.
            searched: True if the planner has searched one, or the robot stands between two drives.
            nothing_reached: True if no work is within reach.
        """
        under_way = self._emulator.onboard.state in UNDER_WAY
        if nothing_reached and not self._returning:
            return self._comes_back_now()
        self._refusals += searched or self._breaks_off
        ends = nothing_reached or not (under_way or self._breaks_off)
        if (self._returning and ends) or self._refusals > MOST_REFUSALS:
            self._enter()
            if nothing_reached:
                self.remains.give_reason(_listed(self._said.things))
            return self._gives_up(reason)
        self._wait_for_way(reason)
        return ""

    def _wait_for_way(self, reason: str) -> None:
        """Note when a way is searched again, the later the more often there was none."""
        self._refused_tick, self._waiting.answer = self._emulator.tick_count, None
        wait_ticks = min(AGAIN_TICKS * 2 ** max(self._refusals - 1, 0), LONGEST_TICKS)
        self._search_tick = self._refused_tick + wait_ticks
        if self._refusals <= 1:
            self._refused_at = []
        if (blocked := self._emulator.onboard.blocked) is not None:
            self._refused_at.append(blocked.place_m)
        names = self._said.things
        warning = f"finds no way round {_listed(names)}, and waits: {reason}"
        self._say(Said.FINDS_NO_WAY, names, self._search_tick, "" if warning == self._warned else warning)
        self._warned = warning

    def _gives_up(self, why: str) -> str:
        """End the job without the rest; return the reason to abort the drive with."""
        unexplained = self.remains.unexplained
        self._end(f"{NO_WAY_ON if unexplained else REST_LEFT_OUT}: {why}")
        return f"{NO_WAY_ON}: {why}" if unexplained else REST_LEFT_OUT

    def stays(self, why: str) -> None:
        """End the job, with all that is not done, because the robot does not take the next plan."""
        self._end(f"{NO_WAY_ON}: {why}")

    @property
    def _held(self) -> bool:
        """True if something that may move stands so near that the robot may not move at all."""
        blocked = self._emulator.onboard.blocked
        return self._emulator.onboard.state in UNDER_WAY and blocked is not None and blocked.too_near

    @property
    def _goes_in_vain(self) -> bool:
        """True if ways round do not lead to new work."""
        return self._in_vain >= MOST_IN_VAIN or len(self._stops) >= MOST_WITHOUT_WORK

    def nothing_remains(self) -> str:
        """Note that the rest is left out; return the reason to abort the drive with, "" to come back for it at once.

        Where something stands so near that the robot may not move at all it waits as without a way.
        """
        if self._held:
            return self.finds_no_way(f"{_listed(self._in_the_way)} stands too near for the robot to move at all")
        if self._goes_in_vain:
            return self._gives_up(f"{len(self._stops)} ways round without new work, before {_listed(self._in_the_way)}")
        if self._emulator.onboard.state != TraversalStatus.DONE:
            if self._comes_back:
                return self._comes_back_now()
            self.remains.give_reason(_listed(self._in_the_way))
        self._end()
        return REST_LEFT_OUT

    def breaks_off(self, request: RestRequest, trajectory: Trajectory, left_out: Iterable[LeftOutStretch]) -> str:
        """Note that the present drive ends for a plan of the rest; return the reason to abort it with.

        Args:
            request: The rest.
            trajectory: Its plan.
            left_out: Stretches of lines that the plan leaves out of it.
        """
        names = self._said.things
        self.remains.note(request.rest, request.seen, trajectory, left_out)
        if self._order is WaitingOrder.LEAVE_OUT:
            self.remains.leave_out({each.id for each in request.seen} - self._for_good, OPERATOR)
        self._passed, self._breaks_off = names, True
        self._say(Said.PLANS, names)
        return going_round(names)

    @property
    def waits(self) -> bool:
        """True while the robot stands before something, and nobody has paused it."""
        onboard = self._emulator.onboard
        pause = onboard.status.pause
        return onboard.blocked is not None and (pause is None or pause.ends_by_itself)

    def returns(self, request: RestRequest, trajectory: Trajectory, left_out: Iterable[LeftOutStretch]) -> None:
        """Note what the plan by which the robot comes back leaves out; see `breaks_off`."""
        self.remains.note(request.rest, request.seen, trajectory, left_out)

    def drive_ends(self) -> RestDraft | None:
        """Return the draft of what was left out, once, after the last line; None if the job is over."""
        if self._emulator.onboard.state != TraversalStatus.DONE:
            self.cancel()
        elif not self.over and self._comes_back:
            self._returning, self._passed = True, ()
            self._forget()
            if (draft := self.draft()) is not None:
                return draft
        self._end()
        return None

    def _comes_back_now(self) -> str:
        """Come back for what was left out with the next search, which is due."""
        self._returning, self._search_tick = True, self._emulator.tick_count
        self._forget()
        return ""

    def _forget(self) -> None:
        """Forget what is not seen now, and what was skipped."""
        self._seen.forget()
        self.remains.retry()

    def drives_on(self, trajectory: Trajectory) -> None:
        """Note that the robot has taken the next plan."""
        self._trajectory, self._breaks_off, self._waiting = trajectory, False, Waiting(PATIENT)
        self._refusals, self._refused_at = 0, []
        self._drives += 1
        self._say(Said.DRIVES, self._passed)

    def cancel(self) -> None:
        """Note that somebody else gives the robot orders: the job ends once it stands, with all that is not done."""
        self._returning, self._breaks_off = True, False
        if self._stands:
            self._end()

    @property
    def _stands(self) -> bool:
        return abs(self._emulator.onboard.estimate.speed_mps) <= RESTING_MPS

    @property
    def left_out(self) -> LeftOut:
        """Undone work at the end of the job; before that, what is left out so far."""
        return self.remains.undone if self.finished else self.remains.left_out

    @property
    def _comes_back(self) -> bool:
        """True if it comes back to something after the last line."""
        return not self._returning and bool(self.remains.reasons_left - self._for_good)

    @property
    def _in_the_way(self) -> tuple[str, ...]:
        """Name of what is in the way."""
        onboard = self._emulator.onboard
        return _names(thing_in_the_way(onboard, seen_things(onboard, self.remains.template.obstacles)))

    def _enter(self) -> None:
        """Enter the work of the present drive."""
        onboard = self._emulator.onboard
        self.remains.enter(self._trajectory, onboard.painted, onboard.status.arc_length_m)

    def _end(self, warning: str = "") -> None:
        """Note that the job is over, with all that is not done."""
        if not self.over:
            self._enter()
            self.over = self.finished = True
            self._say(Said.DRIVES, warning=warning)

    def _say(self, state: int, things: tuple[str, ...] = (), goes_round_tick: int = 0, warning: str = "") -> None:
        """Report what the robot does, if that is new."""
        left_out = self.left_out
        said = Said(
            state=state,
            things=things,
            goes_round_at=Time.of_ns(round(goes_round_tick * 1e9 / TICKS_PER_S)),
            continues=not self.over and (self._breaks_off or self._comes_back),
            drives=self._drives,
            left_out=left_out.stretches,
            left_out_patches=left_out.patches,
        )
        later_s = abs(said.goes_round_at.seconds - self._said.goes_round_at.seconds)
        if said.model_copy(update={"goes_round_at": self._said.goes_round_at}) != self._said or later_s > SOON_S:
            self._said = said
            self._emulator.note_way_round(said, warning)
            self._told()


def going_round(names: Iterable[str]) -> str:
    """Return why a drive ends whose robot goes round these things."""
    return f"goes round {_listed(names)}"


def _names(name: str) -> tuple[str, ...]:
    return (name,) if name else ()


def _listed(names: Iterable[str]) -> str:
    return ", ".join(names) or "what is in its way"
