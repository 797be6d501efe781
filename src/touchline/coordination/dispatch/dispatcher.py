"""Dispatcher of a team: takes requests, assigns them to robots, follows them to their end, and sends robots to charge.

Tasks that no robot has begun are assigned anew at every event: a request, a cancellation, a finished or failed task, a
charged robot, a robot that cannot be used or can again. A task that a robot has begun stays with it unless it fails.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import Any, Final

from touchline.coordination.dispatch.dispatch_memory import DispatchMemory, remember
from touchline.coordination.dispatch.distance_table import DistanceTable
from touchline.coordination.dispatch.place_claims import PlaceClaims
from touchline.coordination.dispatch.robot_records import RobotJob, RobotRecord
from touchline.coordination.dispatch.route_planning import RobotFigures, RoutePlanner
from touchline.coordination.dispatch.task_records import (
    ENDED,
    RUNNING,
    WAITING,
    TaskRecord,
    TaskState,
    stops_of,
)
from touchline.coordination.free_area import FreeArea
from touchline.coordination.tasks import ARRIVED_M
from touchline.schemas.errors import SpecError
from touchline.schemas.task_requests import ChargeRequest, DeliveryRequest, DispatchTask, Request, located, places_of

STANDS_S: Final = 10.0
"""A robot that has stood for so long on its way is blocked."""
_GIVEN_UP_S: Final = 60.0
"""After so long it cannot be used, and its task is assigned anew; after as long again it is tried again."""
_NEARER_S: Final = 1.0
"""The time that its task takes still has fallen by this if a robot has come nearer."""
_CHARGED: Final = 0.005
"""Share that may lack of a full charge."""
BY_ITSELF: Final = ("inserted",)
"""Label of charging tasks that nobody has asked for."""
_SILENT: Final = "is silent"
_REMOVED: Final = "has been removed"
_NOWHERE: Final = complex(math.inf, 0.0)


class TaskDispatcher:
    """Dispatcher of a team.

    Args:
        spec: Requests, docks and figures.
        area: The area.
        homes: Where each robot starts, x + iy (m), by name.
        figures: Figures of the robots.
        radius_m: Radius that each robot keeps free.

    Attributes:
        robots: By name.
        records: All tasks, in the order of their requests.
        stands: Times for which robots have stood on their way: robot, from, until (s), and what for.
    """

    def __init__(
        self, spec: DispatchTask, area: FreeArea, homes: Mapping[str, complex], figures: RobotFigures, radius_m: float
    ) -> None:
        self._spec, self._now_s = spec, 0.0
        self.table = DistanceTable(area, radius_m)
        self._planner = RoutePlanner(spec, self.table, figures)
        for name, at in self._planner.docks.items():
            self.table.check("dispatch", f"docks.{name}", at)
        self._claims = PlaceClaims(area, radius_m, radius_m)
        self._battery_wh = figures.battery_wh
        self.robots = {name: self._robot(name, at, spec.charges.get(name, 1.0)) for name, at in homes.items()}
        self.records: list[TaskRecord] = []
        self.stands: list[dict[str, Any]] = []
        self._changed = True
        self._last_s: float | None = None
        self.add(spec.requests)

    def _robot(self, name: str, at: complex, charge: float = 1.0) -> RobotRecord:
        return RobotRecord(name, at, at, at, self._battery_wh, charge)

    def memory(self, begun_s: float) -> DispatchMemory:
        """Return all that another dispatcher needs to go on.

        Args:
            begun_s: Robots' clock when the team began.
        """
        return remember(self.records, self.robots.values(), begun_s, self._now_s)

    def restore(self, memory: DispatchMemory) -> None:
        """Go on with the tasks of another dispatcher of the same team.

        Args:
            memory: Of that.
        """
        self._now_s = self._last_s = memory.time_s
        self._changed = True
        self.records = [each.record(self._spec.places) for each in memory.tasks]
        tasks = {each.id: each for each in self.records}
        for each in memory.robots:
            if (robot := self.robots.get(each.name)) is not None:
                each.restore(robot, tasks, self._planner.docks)
                robot.stood_s = robot.left_since_s = self._now_s

    def add(self, requests: Sequence[Request]) -> list[str]:
        """Take further requests; return the ids of their tasks.

        Raises:
            SpecError: One names an unknown place or robot, a place where robots cannot be, or an id that there is.
        """
        new: list[TaskRecord] = []
        known = {each.id for each in self.records} | {each.id for each in requests}
        for request in requests:
            if isinstance(request, ChargeRequest):
                self._check_charge(request)
            if request.id and any(each.id == request.id for each in (*self.records, *new)):
                raise SpecError("request", "id", f"is {request.id!r} again", "give another id, or leave it out")
            places = located(request, self._spec.places)
            for field, place in zip(places_of(request), places, strict=True):
                self.table.check("request", field, complex(*place))
            stops = stops_of(request, places)
            number = 1 + len(self.records) + len(new)
            while not request.id and f"task-{number}" in known:
                number += 1
            name = request.id or f"task-{number}"
            known.add(name)
            new.append(TaskRecord(name, request, stops, self._now_s))
        self.records += new
        self._changed = True
        return [each.id for each in new]

    def _check_charge(self, request: ChargeRequest) -> None:
        if not self._planner.docks:
            raise SpecError("request", "category", "is 'charge', but there is no dock", "give the team a dock")
        if request.robot is not None and request.robot not in self.robots:
            problem = f"is {request.robot!r}, which is no robot of the team"
            raise SpecError("request", "robot", problem, f"use {', '.join(self.robots)}")

    def cancel(self, name: str) -> str:
        """Cancel a task; return its reason.

        Raises:
            SpecError: There is none of that name, or it has ended.
        """
        record = next((each for each in self.records if each.id == name), None)
        if record is None:
            remedy = "use an id that `fleet dispatch --queue` prints"
            raise SpecError("request", "cancel", f"is {name!r}, which is no task", remedy)
        if record.state in ENDED:
            raise SpecError("request", "cancel", f"is {name!r}, which is {record.state}", "use a task that goes on")
        robot = self._doing(record)
        reason = "canceled on request"
        if robot is not None:
            reason += _goods(record, robot)
            self._free(robot)
        record.become(TaskState.CANCELED, reason, self._now_s)
        self._changed = True
        return reason

    def _doing(self, record: TaskRecord) -> RobotRecord | None:
        return next((r for r in self.robots.values() if r.job is not None and r.job.record is record), None)

    @property
    def done(self) -> bool:
        """True if all tasks have ended, and no further requests are waited for."""
        going = RUNNING | WAITING - {TaskState.FAILED_TO_ASSIGN}
        return self._spec.ends and not any(each.state in going for each in self._requested)

    @property
    def _requested(self) -> list[TaskRecord]:
        """Tasks that somebody has asked for: not those that charge a robot by itself."""
        return [each for each in self.records if each.request.labels != BY_ITSELF]

    def update(
        self, now_s: float, places: Mapping[str, complex], charges: Mapping[str, float], silent: Collection[str]
    ) -> dict[str, complex]:
        """Return where each robot is to be, x + iy (m); to be called once per update.

        Args:
            now_s: Time since the team began.
            places: Where each robot is, x + iy (m), by name.
            charges: Charge of each that is known, a share of the whole.
            silent: Robots that have not been heard for so long that they are only obstacles.
        """
        elapsed_s = 0.0 if self._last_s is None else now_s - self._last_s
        self._now_s = self._last_s = now_s
        for name, place in places.items():
            if name not in self.robots:
                self.robots[name] = self._robot(name, place)
                self._changed = True
            self.robots[name].see(place, charges.get(name, math.nan), elapsed_s, now_s)
        for robot in self.robots.values():
            self._look_for_failure(robot, silent, gone=robot.name not in places)
            self._work(robot)
        if self._changed:
            self._assign()
        for robot in self.robots.values():
            if robot.job is None and not robot.out:
                self._begin(robot)
        self._share_docks()
        return self._goals()

    def _look_for_failure(self, robot: RobotRecord, silent: Collection[str], *, gone: bool) -> None:
        """Take a robot out of use that is silent or does not move, and back."""
        now_s = self._now_s
        reason = _REMOVED if gone else _SILENT if robot.name in silent else ""
        if robot.out:
            over = robot.out in (_SILENT, _REMOVED) or now_s - robot.out_since_s >= _GIVEN_UP_S
            if not reason and over:
                robot.out, robot.stood_s, self._changed = "", now_s, True
            return
        if not reason and robot.held is None and self._stands_s(robot) >= _GIVEN_UP_S:
            reason = f"has not moved for {_GIVEN_UP_S:g} s{self._obstacle(robot)}"
        if not reason:
            return
        robot.out, robot.out_since_s, self._changed = reason, now_s, True
        if robot.job is not None:
            self._lose(robot, robot.job.record, f"{robot.name} {reason}")
        if gone:
            robot.place = _NOWHERE

    def _stands_s(self, robot: RobotRecord) -> float:
        """Return for how long a robot has stood although it is not where its task needs it (s)."""
        target = robot.target
        if robot.out or robot.job is None or target is None or abs(robot.place - target) <= ARRIVED_M:
            return 0.0
        return self._now_s - robot.stood_s

    def _obstacle(self, robot: RobotRecord) -> str:
        """Return in words whom a standing robot waits for."""
        if robot.waits_for:
            return f": waits for {robot.waits_for}"
        others = [each for each in self.robots.values() if each is not robot]
        nearest = min(others, key=lambda each: abs(each.place - robot.place), default=None)
        return f": {nearest.name} is next to it" if nearest and abs(nearest.place - robot.place) < 1.0 else ""

    def _lose(self, robot: RobotRecord, record: TaskRecord, reason: str) -> None:
        """Queue the task of a robot that cannot do it, or end it if its goods are lost with it."""
        if record.picked_up or not record.stops:
            record.become(TaskState.FAILED, reason + _goods(record, robot), self._now_s)
        else:
            record.become(TaskState.QUEUED, f"{reason}: waits to be assigned anew")
            record.robot, record.started_s = "", math.nan
        self._free(robot)

    def _free(self, robot: RobotRecord) -> None:
        robot.job = robot.target = robot.held = None
        robot.claim_s, robot.waits_for, robot.stood_s = math.inf, "", self._now_s
        robot.rest = robot.home if self._spec.finishing_request == "park" else robot.place
        self._changed = True

    def _work(self, robot: RobotRecord) -> None:
        """Note how far a robot has come with its task."""
        if (job := robot.job) is None:
            return
        if job.charges:
            full = self._spec.recharge_soc - _CHARGED
            if job.dock and robot.charge >= full and abs(robot.place - self._planner.docks[job.dock]) <= ARRIVED_M:
                self._finish(robot, job.record)
            return
        stop, record = job.record.stops[job.stop], job.record
        if robot.held is None and abs(robot.place - stop.place) <= ARRIVED_M and not math.isfinite(job.there_s):
            job.there_s = max(self._now_s, record.request.earliest_start_s if job.stop == 0 else 0.0)
        if not self._now_s >= job.there_s + stop.stay_s:
            return
        record.picked_up |= isinstance(record.request, DeliveryRequest)
        job.stop, job.there_s = job.stop + 1, math.nan
        robot.stood_s, robot.claim_s = self._now_s, math.inf
        if job.stop == len(record.stops):
            self._finish(robot, record)
        else:
            robot.target = record.stops[job.stop].place

    def _finish(self, robot: RobotRecord, record: TaskRecord) -> None:
        record.become(TaskState.COMPLETED, "", self._now_s)
        late = f", {record.late_s:.1f} s late" if record.late_s > 0.0 else ""
        record.reason = f"{robot.name} has finished it{late}"
        self._free(robot)

    def _assign(self) -> None:
        """Assign all tasks that no robot has begun."""
        self._changed = False
        waiting = [each for each in self.records if each.state in WAITING and each.stops]
        robots = [each for each in self.robots.values() if not each.out]
        for robot in self.robots.values():
            robot.route = []
        if not waiting:
            return
        found = self._planner.assigned(robots, waiting, self._now_s)
        for robot, route in zip(robots, found.routes, strict=True):
            robot.route = [waiting[k] for k in route]
            for number, record in enumerate(robot.route):
                record.robot = robot.name
                record.estimate_s = float(found.finished_s[route[number]])
                if number:
                    record.become(TaskState.SELECTED, f"{robot.name} does {robot.route[number - 1].id} before")
                else:
                    doing = "begins in time" if robot.job is None else f"does {robot.job.record.id} before"
                    record.become(TaskState.DISPATCHED, f"{robot.name} {doing}")
        for k, record in enumerate(waiting):
            if not math.isfinite(found.finished_s[k]):
                record.robot, record.estimate_s = "", math.nan
                record.become(TaskState.FAILED_TO_ASSIGN, self._why_nobody(robots, record))

    def _why_nobody(self, robots: Sequence[RobotRecord], record: TaskRecord) -> str:
        if not robots:
            return "no robot can be used: " + ", ".join(f"{each.name} {each.out}" for each in self.robots.values())
        nearest = min(robots, key=lambda each: abs(each.place - record.stops[0].place))
        return f"{nearest.name}: {self._planner.energy(nearest, record, full=bool(self._planner.docks))}"

    def _begin(self, robot: RobotRecord) -> None:
        """Let a robot begin its next task if it is time, or charge."""
        if (asked := self._asked_to_charge(robot)) is not None:
            self._start(robot, asked, "is asked to charge")
            return
        spec, docks = self._spec, self._planner.docks
        if not robot.route:
            least = spec.recharge_threshold
            if spec.finishing_request == "charge":
                least = spec.recharge_soc - 2.0 * _CHARGED
            if docks and robot.charge < least:
                self._charge(robot, f"its charge is {robot.charge:.0%}, and it has no task")
            return
        record = robot.route[0]
        energy = self._planner.energy(robot, record)
        if docks and (not energy.suffices or robot.charge < spec.recharge_threshold):
            why = str(energy) if not energy.suffices else f"its charge is {robot.charge:.0%}"
            self._charge(robot, f"{why}; before {record.id}")
            return
        way_s = self._planner.way_s(robot.place, record.stops[0].place)
        if self._now_s + way_s < record.request.earliest_start_s:
            return
        robot.route = robot.route[1:]
        self._start(robot, record, "drives to its first place")

    def _asked_to_charge(self, robot: RobotRecord) -> TaskRecord | None:
        """Return the request by which a robot is to charge."""
        free = [each for each in self.robots.values() if each.job is None and not each.out]
        for record in self.records:
            request = record.request
            if not isinstance(request, ChargeRequest) or record.state not in WAITING:
                continue
            wanted = request.robot or min(free, key=lambda each: each.charge).name
            if wanted == robot.name and request.earliest_start_s <= self._now_s:
                return record
        return None

    def _charge(self, robot: RobotRecord, why: str) -> None:
        number = sum(each.id.startswith("charge-") for each in self.records) + 1
        request = ChargeRequest(category="charge", robot=robot.name, labels=BY_ITSELF)
        record = TaskRecord(f"charge-{number}", request, (), self._now_s)
        self.records.append(record)
        self._start(robot, record, why)

    def _start(self, robot: RobotRecord, record: TaskRecord, why: str) -> None:
        record.become(TaskState.UNDERWAY, why)
        record.robot, record.started_s = robot.name, self._now_s
        robot.job, robot.claim_s, robot.stood_s = RobotJob(record, why), math.inf, self._now_s
        robot.target = record.stops[0].place if record.stops else None
        robot.left_s, robot.left_since_s = math.inf, self._now_s
        self._changed |= not record.stops

    def _share_docks(self) -> None:
        """Give each free dock to the robot with the least charge that waits for one."""
        for robot in sorted(self.robots.values(), key=lambda each: (each.charge, each.name)):
            if (job := robot.job) is None or not job.charges or job.dock:
                continue
            used = {each.job.dock: each.name for each in self.robots.values() if each.job is not None and each.job.dock}
            free = {name: at for name, at in self._planner.docks.items() if name not in used and not self._is_lost(at)}
            if free:
                job.dock = self._planner.nearest(robot.place, free)
                robot.target, robot.stood_s = free[job.dock], self._now_s
            else:
                robot.rest = robot.place
                job.record.reason = "waits for a dock, " + ", ".join(f"{u} uses {d}" for d, u in used.items())

    def _is_lost(self, dock: complex) -> bool:
        """Return whether a robot that cannot be used stands at a dock."""
        return any(each.out and abs(each.place - dock) < 0.5 for each in self.robots.values())

    def _goals(self) -> dict[str, complex]:
        """Return where each robot is to be, and note how its task goes on."""
        robots = list(self.robots.values())
        self._claims.hold(robots, self._now_s)
        for robot in robots:
            if (job := robot.job) is not None and robot.target is not None:
                self._look_at_job(robot, job)
        found = {}
        docks = list(self._planner.docks.values())
        for robot in robots:
            if robot.out:
                found[robot.name] = robot.place
            elif robot.target is None:
                self._claims.make_room(robot, robots, docks)
                found[robot.name] = robot.rest
            else:
                found[robot.name] = robot.target if robot.held is None else robot.held
        return found

    def _look_at_job(self, robot: RobotRecord, job: RobotJob) -> None:
        """Update state, reason and estimate of a task that a robot does."""
        record, stands_s = job.record, self._stands_s(robot)
        record.estimate_s = self._planner.ends_at(robot, self._now_s)[0]
        if record.estimate_s - self._now_s <= robot.left_s - _NEARER_S:
            robot.left_s, robot.left_since_s = record.estimate_s - self._now_s, self._now_s
        lost_s = self._now_s - robot.left_since_s
        dead = [each for each in self.robots.values() if each.out and self._now_s - each.out_since_s >= STANDS_S]
        if taken := self._claims.taken_by(robot, dead):
            self._lose_for_good(robot, record, taken)
        elif stands_s >= STANDS_S:
            self._note_standing(robot)
            record.become(TaskState.BLOCKED, f"{robot.name} has stood for {stands_s:.0f} s{self._obstacle(robot)}")
        elif lost_s >= _GIVEN_UP_S:
            why = self._obstacle(robot)
            record.become(TaskState.BLOCKED, f"{robot.name} has come no nearer for {lost_s:.0f} s{why}")
        elif record.estimate_s > record.deadline_s:
            doing = self._doing_now(robot, job)
            record.become(TaskState.DELAYED, f"{doing}; expected {record.estimate_s - record.deadline_s:.0f} s late")
        else:
            record.become(TaskState.UNDERWAY, self._doing_now(robot, job))

    def _lose_for_good(self, robot: RobotRecord, record: TaskRecord, taken: str) -> None:
        reason = f"{taken}, which {self.robots[taken].out}, stands at its place"
        record.become(TaskState.FAILED, reason + _goods(record, robot), self._now_s)
        self._free(robot)

    def _note_standing(self, robot: RobotRecord) -> None:
        """Note for how long a robot stands on its way, and for whom."""
        same = [each for each in self.stands if each["robot"] == robot.name and each["from_s"] == robot.stood_s]
        if same:
            same[0]["until_s"] = self._now_s
            return
        found = {"robot": robot.name, "from_s": robot.stood_s, "until_s": self._now_s}
        self.stands.append(found | {"why": self._obstacle(robot).removeprefix(": ") or "nobody is near"})

    def _doing_now(self, robot: RobotRecord, job: RobotJob) -> str:
        if robot.waits_for:
            return f"waits for {robot.waits_for}, which uses its place"
        if job.charges:
            there = robot.target is not None and abs(robot.place - robot.target) <= ARRIVED_M
            return f"{'charges at' if there else 'drives to'} {job.dock}: {job.why}"
        stop, stops = job.record.stops[job.stop], job.record.stops
        if not math.isfinite(job.there_s):
            return f"drives to place {job.stop + 1} of {len(stops)}"
        early = self._now_s < job.there_s
        return f"waits until {job.there_s:g} s" if early else f"{stop.doing} ({job.stop + 1} of {len(stops)})"

    def close(self, reason: str) -> None:
        """End all tasks that go on, as the run ends."""
        for record in self.records:
            if record.state in RUNNING:
                record.become(TaskState.KILLED, reason, self._now_s)

    def queue(self) -> dict[str, Any]:
        """Return tasks and robots as a JSON object."""
        return {
            "time_s": round(self._now_s, 3),
            "tasks": [each.figures() for each in self.records],
            "robots": {name: robot.figures() for name, robot in self.robots.items()},
            "stands": self.stands,
        }


def _goods(record: TaskRecord, robot: RobotRecord) -> str:
    """Return where the goods of a task are, if a robot has them."""
    if not record.picked_up:
        return ""
    return f"; the goods are on {robot.name} at ({robot.place.real:.2f}, {robot.place.imag:.2f}) m"
