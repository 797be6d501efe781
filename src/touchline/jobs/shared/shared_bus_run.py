"""A shared job over the bus: each robot loads its part, and is granted path as the others report progress.

A failed robot does not end the job: the others continue as far as they may, and take over its work on an order.
"""

import time
from collections.abc import Sequence
from typing import Any, Final

from touchline.bus import Bus
from touchline.coordination.traffic.gates import authorities_m
from touchline.jobs.recording.team_recording import begin_team_recording, end_team_recording
from touchline.jobs.shared.assignment import AssignmentStatus, assignments
from touchline.jobs.shared.body_gap import BodyGap
from touchline.jobs.shared.claimed_stretch import publish_stretches
from touchline.jobs.shared.pose_history import simultaneous_poses
from touchline.jobs.shared.remaining_work import RemainingWork
from touchline.jobs.shared.replanning import FieldRobot, no_remaining_work, painted_before, replan_rest
from touchline.jobs.shared.shared_job import SharedJob
from touchline.jobs.shared.shared_robot import SharedRobot, fresh_id
from touchline.jobs.shared.shared_run_settings import SharedRunSettings
from touchline.jobs.shared.standstill_messages import (
    in_the_way,
    out_of_service,
    paused_since,
    why_not_done,
    why_not_finished,
)
from touchline.jobs.watcher import JobFailed, Watcher
from touchline.schemas import topics
from touchline.schemas.errors import PlanningError, TouchlineError
from touchline.schemas.messages import CommandRequest, CommandResponse, Event, Trajectory
from touchline.services.planner.sequencing.wet_paint import NO_LINES

STALLED_S: Final = 20.0
"""Wall-clock time without motion after which a team counts as stalled."""
_LOOK_S: Final = 0.005
_SETTLED_S: Final = 0.2
"""Wall-clock time after which messages sent before the clock was held have arrived."""
_STANDS_S: Final = 60.0
"""Wall-clock time in which an aborted robot comes to rest and reports."""


class SharedBusRun:
    """Shared job in progress.

    Args:
        buses: Buses of the robots, in the order of the job.
        job: The shared job.
        settings: Pace, take-over, recording and timeout.
        watcher: Observer of the job.

    Attributes:
        robots: All robots.
        job: The present job: the rest, once work was taken over.
        gap: Distance between bodies, by their last reported true poses.
        left_out: Work that could not be reached.
        recording: Its figures, if there is one.
        orders: Orders of operators, with their outcomes.
        started_at: Wall clock (monotonic) of the start.
        wall_time_s: Wall-clock duration.
    """

    def __init__(self, buses: Sequence[Bus], job: SharedJob, settings: SharedRunSettings, watcher: Watcher) -> None:
        self.robots, self.job = [SharedRobot(bus, job.vehicle, watcher.event) for bus in buses], job
        self._settings, self._watcher = settings, watcher
        self._crew, self.gap = list(self.robots), BodyGap(job.vehicle)
        self._gathering = self._undone = self._asked = False
        self._painted, self._begun_s = NO_LINES, 0.0
        self._reported = dict.fromkeys((robot.name for robot in self.robots), "")
        self._moved_at, self._reached_m = 0.0, -1.0
        self.left_out, self._driven = no_remaining_work(job), list[Trajectory]()
        self.recording: dict[str, Any] | None = None
        self.orders: list[dict[str, str | bool]] = []
        self.started_at = self.wall_time_s = 0.0

    def run(self) -> None:
        """Carry out the job.

        Raises:
            JobFailed: A robot refused, nobody moves on, or a failed robot's work was not taken over in time.
            CallError: A robot did not answer.
        """
        record = self._settings.record
        if record is not None:
            begin_team_recording(self._recorder, record, self._watcher)
        self._watcher.stage("Covering" if self.job.template.areas else "Painting")
        try:
            self._begin(self.job, self.robots, here=False)
            self._follow()
            self._stand_down()
        except (TouchlineError, KeyboardInterrupt):
            self._abort_all()
            raise
        finally:
            for robot in self.robots:
                robot.stretch.release()
            if record is not None:
                self.recording = end_team_recording(self._recorder, record, self._watcher)
        self.wall_time_s = time.monotonic() - self.started_at
        for robot in self.robots:
            robot.conclude()

    @property
    def _recorder(self) -> Bus:
        """Bus of the bridge, which serves all robots, whatever happens to them."""
        return self.robots[0].bus

    def _begin(self, job: SharedJob, crew: Sequence[SharedRobot], *, here: bool) -> None:
        self.job, self._crew = job, list(crew)
        for robot, assignment in zip(crew, assignments(job), strict=True):
            robot.take(assignment, self._begun_s, here=here)
            robot.set_speed(self._settings.speed)
        self._authorize()
        self._moved_at, self._reached_m = time.monotonic(), -1.0
        self.started_at = self.started_at or self._moved_at
        for robot in crew:
            robot.command(topics.START)

    def _authorize(self) -> None:
        """Send every robot its authority if that has changed."""
        until_m = authorities_m(self.job.table.gates, [robot.progress_m for robot in self._crew])
        for robot, arc_m in zip(self._crew, until_m, strict=True):
            if not (robot.out or robot.finished):
                robot.authorize(min(arc_m, robot.limit_m))
        self._claim()

    def _claim(self) -> None:
        """Publish for every robot the stretch of its path that the others avoid."""
        for robot in self.robots:
            robot.claim()
        publish_stretches([robot.stretch for robot in self.robots], time.monotonic())

    def _follow(self) -> None:
        while not self._over:
            self._look()
            for robot in self.robots:
                for kind, call in robot.orders():
                    done, text = self._take_over(robot) if kind == "take-over" else self._remove(robot)
                    self._note(robot, kind, done=done, outcome=text)
                    call.reply(CommandResponse(success=done, message=text))
            if self._gathering and all(robot.rests for robot in self._crew if not robot.out):
                self._hand_over()
            else:
                self._authorize()
                self._look_whether_anybody_moves()
                self._look_whether_all_else_is_done()
            time.sleep(_LOOK_S)

    @property
    def _over(self) -> bool:
        if self._gathering or self._undone or not all(robot.done for robot in self._crew):
            return False
        return not self._in_the_way or self._waited_s > self._settings.ordered_within_s

    @property
    def _in_the_way(self) -> list[SharedRobot]:
        """Robots that failed beside work that could not be reached, until that is taken over."""
        return [robot for robot in self.robots if robot.out] if self.left_out and not self._ends_by_itself else []

    @property
    def _failed(self) -> list[SharedRobot]:
        """Robots that are out of service and have not finished."""
        return [robot for robot in self._crew if robot.out and not robot.done]

    @property
    def _ends_by_itself(self) -> bool:
        return self._settings.take_over_after_s is not None

    @property
    def _waited_s(self) -> float:
        """Time since any robot has moved or failed, s."""
        return time.monotonic() - max(self._moved_at, *(robot.out_at for robot in self.robots))

    def _look(self) -> None:
        """Take all messages, and report failures."""
        self._watcher.check()
        for robot in self.robots:
            robot.listen()
            if robot in self._crew:
                robot.look()
            if robot.out != self._reported[robot.name]:
                self._reported[robot.name] = robot.out
                self._report_state(robot)
        there = [robot for robot in self.robots if not robot.gone]
        seen = {robot.name: robot.truth.poses for robot in there}
        poses = simultaneous_poses(seen, {robot.name for robot in there if robot.stands}, time.time())
        for name in self.gap.look(poses) if poses else ():
            self._watcher.event(Event.ERROR, f"{name} touches another robot")
            next(robot for robot in self.robots if robot.name == name).touch()

    def _report_state(self, robot: SharedRobot) -> None:
        if robot.out:
            self._watcher.event(Event.ERROR, out_of_service(robot, self._settings))
        else:
            self._watcher.event(Event.INFO, f"{robot.name} is in service again")

    def _look_whether_anybody_moves(self) -> None:
        now_m = sum(robot.furthest_m for robot in self._crew)
        if now_m > self._reached_m:
            self._moved_at, self._reached_m = time.monotonic(), now_m
            where = ", ".join(f"{robot.name} {robot.status.segment_id}" for robot in self._crew)
            self._watcher.progress(now_m / sum(path.end_m for path in self.job.paths), where)
        if paused := [robot for robot in self._crew if robot.paused_since is not None]:
            self._moved_at = time.monotonic()  # a robot paused by an operator stands until an operator resumes it
            self._watcher.progress(now_m / sum(path.end_m for path in self.job.paths), paused_since(paused))
        failed = self._failed
        after_s = self._settings.take_over_after_s
        if failed and after_s is not None and not (self._gathering or self._undone):
            if time.monotonic() - failed[0].out_at >= after_s:
                done, text = self._take_over(failed[0])
                self._note(failed[0], "take-over", done=done, outcome=text)
        elif (failed or self._undone) and not self._gathering:
            if self._waited_s > self._settings.ordered_within_s or (self._undone and self._ends_by_itself):
                raise JobFailed(why_not_finished(failed, self._remaining.names, self._settings, undone=self._undone))
        elif time.monotonic() - self._moved_at > STALLED_S and not all(robot.done for robot in self._crew):
            raise JobFailed(f"no robot has moved for {STALLED_S:.0f} s ({why_not_done(self._crew)})")

    def _look_whether_all_else_is_done(self) -> None:
        over = all(robot.done for robot in self._crew)
        if over and not self._asked and (there := self._in_the_way):
            self._watcher.event(Event.WARN, in_the_way(there, self.left_out, self._settings))
        self._asked = over

    def _note(self, robot: SharedRobot, kind: str, *, done: bool, outcome: str) -> None:
        self.orders.append({"robot": robot.name, "order": kind, "done": done, "outcome": outcome})
        self._watcher.event(Event.INFO if done else Event.WARN, f"{kind} {robot.name}: {outcome}")

    def _remove(self, robot: SharedRobot) -> tuple[bool, str]:
        """Confirm that a robot was carried away; return success and message."""
        if not robot.out or robot.gone:
            return False, f"{robot.name} does not stand there out of service"
        robot.gone, self._moved_at = True, time.monotonic()
        return True, f"{robot.name} was carried away; order take-over to have its remaining work done"

    def _take_over(self, robot: SharedRobot) -> tuple[bool, str]:
        """Have all others stop outside lines, so that the rest can be replanned; return success and message."""
        able = [each for each in self.robots if not each.out]
        if not robot.out:
            return False, f"{robot.name} is in service and does its own share"
        if not able:
            return False, "no robot can take over"
        if not self._gathering:
            self._gathering = True
            for each in able:  # so that no robot has passed its stop before the order arrives
                each.set_speed(0.0)
            settled_at = time.monotonic() + _SETTLED_S
            while time.monotonic() < settled_at:
                self._look()
                time.sleep(_LOOK_S)
            for each in self._crew:
                if each.assignment is not None and not each.out:
                    each.limit_m = each.assignment.next_hold_m(each.furthest_m)
            self._authorize()
            for each in able:
                each.set_speed(self._settings.speed)
            self._moved_at = time.monotonic()
        return True, "the others take over as soon as they stand"

    def _hand_over(self) -> None:
        """Have every robot abort where it stands, and start the rest."""
        self._stand_down()
        self._gathering = False
        remaining, statuses = self._remaining, self._statuses
        beliefs, now_s = [robot.painted for robot in self._crew], max(robot.shared_s for robot in self._crew)
        painted = painted_before(self.job, beliefs, self._painted, now_s - self._begun_s)
        robots = [FieldRobot(robot.place, not robot.out) for robot in self.robots if not robot.gone]
        try:
            rest = replan_rest(self.job, remaining, robots, painted, self._watcher.progress) if remaining else None
        except PlanningError as error:
            self._undone = True
            self._watcher.event(Event.ERROR, f"the rest cannot be done: {error}")
            return
        for robot in self._crew:
            robot.conclude()
        self._undone, self._painted, self._begun_s = False, painted, now_s
        if rest is None:
            self._crew, self.left_out = [], no_remaining_work(self.job)
            return
        self._driven += [each.driven for each in statuses]
        self.left_out = rest.left_out
        self._watcher.event(Event.INFO, f"the rest is done: {rest}")
        self._begin(rest.job, [robot for robot in self.robots if robot.name in rest.crew], here=True)

    def _stand_down(self) -> None:
        """Have every robot abort where it stands, and report."""
        for robot in self._crew:
            if robot.out:
                robot.keep_out()
            else:
                robot.call_off()
        self._claim()
        deadline = time.monotonic() + _STANDS_S
        while not all(robot.out or robot.report is not None for robot in self._crew):
            if time.monotonic() > deadline:
                raise JobFailed("the others do not come to rest, and cannot take over")
            self._look()
            time.sleep(_LOOK_S)

    @property
    def _statuses(self) -> list[AssignmentStatus]:
        """Status of the robots' assignments."""
        return [each for robot in self._crew for each in robot.assignment_statuses]

    @property
    def _remaining(self) -> RemainingWork:
        """Unfinished work, by the robots' estimates."""
        return self.left_out.joined(self.job, self._statuses)

    @property
    def planned(self) -> list[Trajectory]:
        """All planned trajectories: aborted ones as far as they were driven, and their replacements."""
        return [*self._driven, *(each.trajectory for each in self.job.plans)]

    def _abort_all(self) -> None:
        """Stop all robots; skip those that do not answer any more."""
        self._watcher.stage("Stopping")
        for robot in self.robots:
            try:
                robot.bus.call(topics.ABORT, CommandRequest(request_id=fresh_id()), 2.0)
            except TouchlineError as error:
                self._watcher.event(Event.WARN, str(error))
