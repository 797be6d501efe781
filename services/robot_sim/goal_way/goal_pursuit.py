"""Drive of a robot to a goal, with ways that are planned anew round what its lidars see."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
import shapely

from touchline.onboard.interface import TICKS_PER_S
from touchline.schemas.known_ground import KnownGround, Ring
from touchline.schemas.messages import (
    LeavingTrajectory,
    PauseStatus,
    PlanOptions,
    PoseGoal,
    Trajectory,
    TraversalStatus,
    WaySearch,
)
from touchline.services.robot_sim.emulator import UNDER_WAY, Emulator
from touchline.services.robot_sim.goal_way.goal_margins import NEARER_M, GoalMargins
from touchline.services.robot_sim.goal_way.seen_ground import CELL_M, FADED_S, SeenGround, cell_middles
from touchline.services.robot_sim.goal_way.way_ahead import WayAhead
from touchline.services.robot_sim.goal_way.way_request import ChosenWay, PlannedWay, Planning, WayRequest
from touchline.services.robot_sim.grown_outlines import body_at

KEEP_S: Final = 0.4
"""Sim time for which the present way is kept while the next one is planned, if sim time stands still for that."""
AGAIN_S: Final = 0.5
"""Least time from one plan to the next."""
SET_OFF_M: Final = 0.02
STANDS_MPS: Final = 0.01
STANDS_RADPS: Final = 0.02
"""Speed and yaw rate below which it stands."""
LEFT_M: Final = 0.03
LEFT_RAD: Final = math.radians(5.0)
"""Distance and turn from which a robot no longer stands where a way from rest begins."""
STANDING_S: Final = 0.3
"""Time for which something has to be in the way of a standing robot before it looks for another way."""
COMES_AND_GOES_S: Final = 2.0
"""The same, if what is in the way comes and goes, as the noise of a thing at the least distance does;"""
WAITING_S: Final = 5.0
"""and if it moves."""
PATIENCE_S: Final = 15.0
"""Time without progress after which the robot gives up;"""
MOVING_PATIENCE_S: Final = 60.0
"""and if something in its way has moved within PATIENCE_S."""
PROGRESS_M: Final = 0.3
QUICKER: Final = 0.85
"""Share of the time of a way with more margin that one with less may take."""
STOPS_MAX: Final = 40
"""Number of ways begun from rest after which it gives up."""
FORGETS: Final = 2
"""Number of times that it forgets what it has not seen again."""
THOROUGH_MAX: Final = 3
"""Number of thorough searches after which it gives up: they may find ways, too."""
NOISE_M: Final = 0.03
"""Distance by which a way may come nearer to what is seen than planned: noise of returns, and size of cells."""
HASTE: Final = 0.3
"""Share of the time for which the present way is kept after which a driving robot takes the first way that it finds."""
DETOUR: Final = 1.3
"""Factor of the least time from which a way with less margin is looked for, too."""
BACK_M: Final = (0.3, 0.8, 2.0, 4.0)
"""Distances by which a robot backs off that stands too near to something to drive another way."""
SQUARED_RAD: Final = tuple(math.radians(turn) for turn in sorted(range(-30, 31), key=abs))
"""Turns by which it may square itself up first."""
SQUARE_M: Final = 5.0
"""Room round all that is known, and grid of its edges: ways begun in one place and the next have the same ground."""
BOTH_WAYS: Final = WaySearch(quick=True, spare_share=0.9)
FORWARD: Final = BOTH_WAYS.model_copy(update={"no_reversing": True})
AT_LAST: Final = WaySearch(spare_share=0.9)
GO_ROUND: Final = "the robot goes round something"


class _Leave(NamedTuple):
    """Begin of a way to plan.

    Attributes:
        options: Planning options.
        begins: Part of the present way that is driven in any case, or where the robot stands.
        running: The present drive, if the robot moves.
    """

    options: PlanOptions
    begins: WayAhead
    running: LeavingTrajectory | None = None


class GoalPursuit:
    """Behaviour of a robot with a lidar that drives to a goal.

    The owner calls `look` between ticks, ten times a second of sim time, and then goes through `stops` and, if that
    gives no reason, through `replaces`: both yield requests for plans. It loads the ways that they find.

    Args:
        emulator: The robot.
        goal: The goal.
        options: Planning options without a start.
        seen: Ground that is known, and what the robot has seen of it.

    Attributes:
        driven_s: Time for which the robot had been under way before the present drive.
        keep_s: Sim time for which a driving robot keeps its present way: so long planning may take.
        problem: Why there was no way the last time that there was none.
    """

    def __init__(self, emulator: Emulator, goal: PoseGoal, options: PlanOptions, seen: SeenGround) -> None:
        self._emulator, self._goal, self._options, self._seen = emulator, goal, options, seen
        self._ground = seen.known
        if emulator.onboard.perception is not None:
            emulator.onboard.perception.whole_scans = True  # beams without a return show ground as free
        self._vehicle = emulator.vehicle
        self._margins = GoalMargins(emulator, seen)
        self._clear_m = 0.0
        self._way = WayAhead.at(self._pose)
        self._scan_tick = -1
        self._retry_tick = 0
        self._progress = 0, math.inf, math.inf
        self._moved_tick = 0
        self._stops, self._forgets_left, self._thorough_left = 0, FORGETS, THOROUGH_MAX
        self._began_s: float | None = None
        self.driven_s, self.keep_s = 0.0, KEEP_S
        self._next: ChosenWay | None = None
        self._then: tuple[ChosenWay, ...] = ()
        self._then_before: tuple[ChosenWay, ...] = ()
        self._shut_in = False
        self._from = self._pose
        self._present = Trajectory()
        self.problem = ""

    def begins(self, trajectory: Trajectory) -> None:
        """Note that the robot has taken a way."""
        now_s = self._emulator.time_s - self._emulator.onboard.status.elapsed_s
        if self._began_s is None:
            self._began_s = now_s
        self.driven_s = now_s - self._began_s
        self._present = trajectory
        self._way = WayAhead.of(trajectory)
        self._clear_m = self._margins.clearance_m(self._way, self._margins.levels_m[0])

    @property
    def _kept_m(self) -> float:
        """Distance from things at which the present way is left for another."""
        return max(min(self._margins.needed_m, self._clear_m - NOISE_M), -self._margins.farther_m)

    def look(self) -> None:
        """Enter the last scan of each lidar."""
        perception, tick = self._emulator.onboard.perception, self._emulator.tick_count
        if (blocked := self._emulator.onboard.blocked) is not None and blocked.moving:
            self._moved_tick = tick
        assert perception is not None  # a robot without a lidar sees nothing
        hits = perception.hits
        if hits is None or hits.tick == self._scan_tick:
            return
        self._scan_tick = hits.tick
        for spec, beams in perception.scans:
            self._seen.enter(beams, min(spec.dark_m, spec.max_m), tick)
        self._seen.stands_on(self._standing_body)

    def waits(self, ticks: int) -> None:
        """Note that the robot waits for somebody, which counts as progress, and plans nothing for some ticks."""
        tick = self._emulator.tick_count
        self._progress = tick, *self._pose[:2]
        self._retry_tick = max(self._retry_tick, tick + ticks)

    def stays(self) -> None:
        """Note that the robot does not take the way that was chosen last, nor give up: it drives on as before."""
        self._next, self._then = None, self._then_before
        self._stops = min(self._stops, STOPS_MAX - 1)

    @property
    def stands(self) -> bool:
        """True while the robot stands amid a drive, where ways from rest were looked for last."""
        return self._emulator.onboard.state in UNDER_WAY and self._stands and not self.has_left

    @property
    def has_left(self) -> bool:
        """True if the robot has left the place from which ways from rest were looked for last."""
        x, y, heading = self._pose
        off_m = math.hypot(x - self._from[0], y - self._from[1])
        return off_m > LEFT_M or abs(math.remainder(heading - self._from[2], math.tau)) > LEFT_RAD

    @property
    def continues(self) -> bool:
        """True if another drive follows the present one."""
        return bool(self._then)

    def stops(self) -> Planning[str]:
        """Choose whether the present drive ends where the robot stands; return why, "" to go on.

        A robot that stands before something drives another way from there, if there is one: it is the next.
        """
        tick = self._emulator.tick_count
        waited_s = (tick - self._progress_tick(tick)) / TICKS_PER_S
        if tick < self._retry_tick or (self._then and not self._is_blocked):
            return ""
        self._then_before, self._then, self._from = self._then, (), self._pose
        if not self._sets_off and not self._is_blocked:
            return ""
        self._retry_tick = tick + round(AGAIN_S * TICKS_PER_S)
        moved = tick - self._moved_tick <= PATIENCE_S * TICKS_PER_S
        patient = waited_s <= (MOVING_PATIENCE_S if moved else PATIENCE_S) and self._stops < STOPS_MAX
        if self._too_near:
            self.problem = self._emulator.onboard.status.reason
            return "" if patient else self.problem
        if patient:
            self._next = yield from self._from_pose(self._pose)
            if self._next is None and not self._sets_off:
                self._next = yield from self._backs_off()
        elif (following := (yield from self._at_last())) is not None:
            self._next = following
        else:
            return self.problem
        if self._next is not None:
            self._stops += 1
            return GO_ROUND
        self._retry_tick = tick + round(min(max(AGAIN_S, waited_s), WAITING_S) * TICKS_PER_S)
        if waited_s > WAITING_S and self._forgets_left:
            self._forgets_left -= 1
            self._seen.forget(tick - round(FADED_S * TICKS_PER_S))
        return ""

    @property
    def _too_near(self) -> bool:
        """True if something that may move is so near that the robot may not move at all."""
        blocked = self._emulator.onboard.blocked
        return blocked is not None and blocked.too_near

    def _at_last(self) -> Planning[ChosenWay | None]:
        """Return a way by a thorough search; its refusal says whether a way exists, and where it is narrowest."""
        if self._stops >= STOPS_MAX or not self._thorough_left:
            self.problem = f"the robot has begun {self._stops} ways from rest without reaching its goal"
            return None
        self._thorough_left -= 1
        leave = _Leave(self._standing_at(self._pose), WayAhead.at(self._pose))
        found = yield from self._with_margin(self._margins.needed_m, leave, AT_LAST)
        return None if found is None else ChosenWay(found[1].trajectory, found[0].cause)

    @property
    def _sets_off(self) -> bool:
        """True if a robot that has yet to set off has seen that its way meets something."""
        status = self._emulator.onboard.status
        waits = status.state == TraversalStatus.RUNNING and status.arc_length_m < SET_OFF_M and self._stands
        return waits and self._meets(self._way)

    @property
    def _is_blocked(self) -> bool:
        """True if something has been in the way of the standing robot for a while."""
        onboard, tick = self._emulator.onboard, self._emulator.tick_count
        if onboard.state not in UNDER_WAY or not self._stands:
            return False
        pause = onboard.status.pause
        waits_since = self._progress_tick(tick) if pause is not None and pause.cause == PauseStatus.IN_THE_WAY else tick
        blocked_since = onboard.blocked.since_tick if onboard.blocked is not None else tick
        moves = onboard.blocked is not None and onboard.blocked.moving
        waiting_s = WAITING_S if moves else COMES_AND_GOES_S
        return tick - blocked_since >= STANDING_S * TICKS_PER_S or tick - waits_since >= waiting_s * TICKS_PER_S

    def _meets(self, way: WayAhead) -> bool:
        """Return whether the robot would come too near to something on a way."""
        return self._margins.clearance_m(way, self._kept_m) < self._kept_m

    def _standing_at(self, pose: tuple[float, float, float]) -> PlanOptions:
        """Return the options of a way that begins where the robot stands."""
        return PlanOptions.model_validate({**dict(self._options), "start": pose})

    def _from_pose(self, pose: tuple[float, float, float]) -> Planning[ChosenWay | None]:
        """Return another way from where the robot stands; None if there is none."""
        found = yield from self._planned(_Leave(self._standing_at(pose), WayAhead.at(pose)))
        return None if found is None else ChosenWay(found[1].trajectory, found[0].cause)

    def _backs_off(self) -> Planning[ChosenWay | None]:
        """Return a way straight back over seen ground to where another way begins; None if there is none.

        It squares itself up first where that leaves more room.
        """
        needed_m, start = self._margins.needed_m, self._pose
        now_m = self._margins.clearance_m(WayAhead.at(start), self._margins.needed_now_m)
        squared = self._squared_up(now_m)
        x, y, heading = squared
        for back_m in BACK_M:
            end = x - back_m * math.cos(heading), y - back_m * math.sin(heading), heading
            if self._comes_nearer(WayAhead.back(squared, end), now_m):
                return None
            if self._margins.clearance_m(WayAhead.at(end), needed_m) < needed_m:
                continue
            if (following := (yield from self._from_pose(end))) is None:
                continue
            ways = []
            for begin, aim in pairwise(dict.fromkeys((start, squared, end))):
                if (way := (yield from self._straight(begin, aim, now_m))) is None:
                    return None
                ways.append(way)
            self._then = (*ways[1:], following)
            return ways[0]
        return None

    def _comes_nearer(self, way: WayAhead, now_m: float) -> bool:
        """Return whether a way leads nearer to things than the robot is now."""
        return self._margins.clearance_m(way, self._margins.needed_now_m) < now_m - NEARER_M

    def _squared_up(self, now_m: float) -> tuple[float, float, float]:
        """Return the pose here, turned to where there is most room, if that is more than now."""
        x, y, heading = self._pose
        poses = [(x, y, heading + turn) for turn in SQUARED_RAD]
        rooms_m = self._margins.clearances_m([*map(WayAhead.at, poses)], self._margins.needed_now_m)
        return poses[int(np.argmax(rooms_m))] if max(rooms_m) > now_m + NEARER_M else self._pose

    def _straight(
        self, start: tuple[float, float, float], end: tuple[float, float, float], now_m: float
    ) -> Planning[ChosenWay | None]:
        """Return a turn on the spot or a straight from pose to pose; None if it leads nearer to things than now."""
        goal = PoseGoal(x_m=end[0], y_m=end[1], heading_rad=math.remainder(end[2], math.tau))
        request = WayRequest(goal, self._standing_at(start))
        planned = yield request
        if isinstance(planned, str):
            return None
        way = WayAhead.of(planned.trajectory)
        if self._comes_nearer(way, now_m) or not self._seen_free_behind(way):
            return None
        return ChosenWay(planned.trajectory, request.cause)

    def replaces(self) -> Planning[ChosenWay | None]:
        """Choose another way that takes over under way, if the present one meets what was seen; None: go on."""
        onboard, tick = self._emulator.onboard, self._emulator.tick_count
        if onboard.state != TraversalStatus.RUNNING or tick < self._retry_tick or self._then:
            return None
        status = onboard.status
        ahead = self._way.from_station(status.arc_length_m)
        if not self._meets(ahead):
            return None
        self._retry_tick = tick + round(AGAIN_S * TICKS_PER_S)
        keep_s = self.keep_s
        leaving = LeavingTrajectory(trajectory=self._present, arc_length_m=status.arc_length_m, keep_s=keep_s)
        drive, speed_mps = self._vehicle.drive, abs(float(onboard.estimate[3]))
        kept_m = (speed_mps + 0.5 * drive.max_acceleration_mps2 * keep_s) * keep_s
        begins = ahead.where(ahead.station_m <= ahead.station_m[0] + kept_m)
        found = yield from self._planned(_Leave(self._options, begins, leaving))
        return None if found is None else ChosenWay(found[1].trajectory, found[0].cause)

    def next_way(self) -> ChosenWay | None:
        """Return the way after a drive that has ended, from where the robot stands; None: that was the last."""
        following, self._next = self._next, None
        if following is None and self._then:
            following, *then = self._then
            self._then = tuple(then)
        return following

    @property
    def _standing_body(self) -> shapely.Polygon:
        return body_at(self._pose, self._vehicle)

    @property
    def _pose(self) -> tuple[float, float, float]:
        x, y, heading = self._emulator.onboard.estimate[:3]
        return x, y, heading

    @property
    def _stands(self) -> bool:
        speed_mps, yaw_rate_radps = self._emulator.onboard.estimate[3:5]
        return abs(speed_mps) < STANDS_MPS and abs(yaw_rate_radps) < STANDS_RADPS

    def _progress_tick(self, tick: int) -> int:
        """Return the tick at which the robot was last found to have moved on."""
        x, y, _ = self._pose
        if math.hypot(x - self._progress[1], y - self._progress[2]) > PROGRESS_M:
            self._progress = tick, x, y
        return self._progress[0]

    def _planned(self, leave: _Leave) -> Planning[tuple[WayRequest, PlannedWay] | None]:
        """Plan round what was seen, with as much margin as there is room for; None if there is no such way."""
        best: tuple[WayRequest, PlannedWay] | None = None
        levels_m = self._margins.levels_from_m(leave.begins)
        if self._shut_in and not (yield from self._is_way(leave)):
            return None
        latest_tick = self._emulator.tick_count + round(HASTE * self.keep_s * TICKS_PER_S)
        for margin_m in levels_m:
            found = yield from self._with_margin(margin_m, leave, FORWARD)
            if found is None:
                unasked = margin_m == levels_m[0] and leave.running is None and not self._shut_in
                if unasked and not (yield from self._is_way(leave)):
                    self._shut_in = True
                    return None
                continue
            if best is None or found[1].total_time_s < QUICKER * best[1].total_time_s:
                best = found
            hurries = leave.running is not None and self._emulator.tick_count > latest_tick
            if hurries or best[1].total_time_s < DETOUR * self._least_s:
                break
        if best is None and leave.running is None:
            for margin_m in levels_m[1:]:
                best = best or (yield from self._with_margin(margin_m, leave, BOTH_WAYS))
        self._shut_in = best is None
        return best

    def _is_way(self, leave: _Leave) -> Planning[bool]:
        """Return whether there is a way with the least margin: else none is looked for with more."""
        search = BOTH_WAYS if leave.running is None else FORWARD
        return (yield from self._made(self._margins.levels_m[-1], leave, search)) is not None

    @property
    def _least_s(self) -> float:
        """Time to the goal straight ahead, with a second for setting off and another for stopping."""
        x, y = self._emulator.onboard.estimate[:2]
        apart_m = float(np.hypot(self._goal.x_m - x, self._goal.y_m - y))
        return 2.0 + apart_m / self._vehicle.drive.transit_speed_mps

    def _with_margin(
        self, margin_m: float, leave: _Leave, search: WaySearch
    ) -> Planning[tuple[WayRequest, PlannedWay] | None]:
        """Plan with a margin as `_made` does; None if there is no such way, or the robot cannot drive it."""
        made = yield from self._made(margin_m, leave, search)
        if made is None:
            return None
        way = WayAhead.of(made[1].trajectory)
        if not self._margins.passes(way, leave.begins):
            self.problem = "the robot stands too near to something to drive off"
        elif not search.no_reversing and not self._seen_free_behind(way):
            self.problem = "the only way leads backward over ground that the robot has not seen"
        else:
            return made
        return None

    def _made(
        self, margin_m: float, leave: _Leave, search: WaySearch
    ) -> Planning[tuple[WayRequest, PlannedWay] | None]:
        """Plan with a margin, things nearer to where the way begins moved off; None if there is no such way."""
        boundary = self._ground.boundary or self._surroundings()
        known = KnownGround(boundary=boundary, obstacles=self._ground.obstacles)
        options = leave.options.model_copy(update={"margin_m": margin_m})
        seen = self._margins.planned(known, leave.begins, margin_m)
        request = WayRequest(self._goal, options, seen, search, leave.running)
        planned = yield request
        if isinstance(planned, str):
            self.problem = planned
            return None
        return request, planned

    def _surroundings(self) -> Ring:
        """Return a rectangle with room round the robot, the goal and all things."""
        places = np.vstack(
            (*(each.places_m for each in self._margins.seen_things), self._pose[:2], (self._goal.x_m, self._goal.y_m))
        )
        west, south = (SQUARE_M * math.floor(low / SQUARE_M) - SQUARE_M for low in places.min(axis=0).tolist())
        east, north = (SQUARE_M * math.ceil(high / SQUARE_M) + SQUARE_M for high in places.max(axis=0).tolist())
        return (west, south), (east, south), (east, north), (west, north)

    def _seen_free_behind(self, way: WayAhead) -> bool:
        """Return whether the robot sees behind, or drives this way backward only over ground that it saw as free."""
        backward = way.poses[way.backward]
        if not len(backward) or self._emulator.onboard.protection.sees_all_round:
            return True
        own = self._standing_body.buffer(2.0 * CELL_M)
        swept = shapely.union_all([body_at((x, y, turn), self._vehicle) for x, y, turn in backward.tolist()])
        points = cell_middles(shapely.difference(swept, own))
        return not len(points) or bool(self._seen.free(points).all())
