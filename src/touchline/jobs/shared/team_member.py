"""Robot of a simulated shared job: its emulator, assignment and reported progress."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.jobs.shared.assignment import Assignment, AssignmentStatus
from touchline.jobs.shared.claimed_stretch import NOTHING, ClaimedStretch
from touchline.jobs.shared.joint_paint import Work
from touchline.jobs.single.simulation import Outcome
from touchline.onboard import Onboard
from touchline.onboard.interface import TICKS_PER_S
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.messages import NavPath, TraversalStatus
from touchline.schemas.setup import Setup
from touchline.services.robot_sim import tick_log
from touchline.services.robot_sim.emulator import UNDER_WAY, Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.loaded_job import Taking
from touchline.services.robot_sim.packing import Payload
from touchline.services.robot_sim.settling import RESTING_MPS
from touchline.services.robot_sim.telemetry import Telemetry

SLICE_TICKS: Final = 10
"""Robots report, and get their authority, ten times a second."""

Floats = NDArray[np.float64]
Listener = Callable[[str, list[Payload]], None]


@dataclass
class TeamMember:
    """One robot.

    Attributes:
        name: Name for people.
        emulator, onboard: Its emulator and onboard computer.
        task: Its assignment, if any.
        dead: True if it is out of service, where it stands.
        gone: True if it was carried away since.
        until_m: Upper bound of its authority, whatever the traffic rules allow.
        furthest_m: Largest reported arc length.
        waited_s: Time for which it was held.
        ended_s: Time at which it last drove, sim time.
        works, outcomes: Results of finished assignments.
        telemetry: Its telemetry, if that is hashed or recorded.
        listener: Called with all telemetry, by its name.
        stretch: Stretch of its path that it has for itself.
    """

    name: str
    emulator: Emulator
    onboard: Onboard
    task: Assignment | None = None
    dead: bool = False
    gone: bool = False
    until_m: float = math.inf
    furthest_m: float = 0.0
    waited_s: float = 0.0
    ended_s: float = 0.0
    works: list[Work] = field(default_factory=list)
    outcomes: list[Outcome] = field(default_factory=list)
    telemetry: Telemetry | None = None
    listener: Listener | None = None

    def __post_init__(self) -> None:
        """Create its runner and publish its setup."""
        self._authority_m = math.inf
        self.stretch = ClaimedStretch(self._publish_claimed)
        if self.telemetry is not None:
            self._publish([self.telemetry.setup(), *self.telemetry.standing(), *self.telemetry.awake()])
        self._runner = FastRunner(self.emulator)
        self._rows: Floats = np.zeros((SLICE_TICKS, tick_log.columns(len(self.emulator.vehicle.drive.actuators))))

    @classmethod
    def of(cls, name: str, setup: Setup, *, hashed: bool = False, listener: Listener | None = None) -> "TeamMember":
        """Create a robot without an assignment.

        Args:
            name: Name for people.
            setup: Vehicle, computer and world.
            hashed: True to keep the hash of its sessions.
            listener: Called with all telemetry, by its name.
        """
        onboard = Onboard(setup.vehicle, setup.onboard)
        emulator = Emulator(setup.vehicle, setup.scenario, setup.onboard, onboard)
        telemetry = Telemetry(emulator) if hashed or listener is not None else None
        return cls(name, emulator, onboard, telemetry=telemetry, listener=listener)

    @property
    def under_way(self) -> bool:
        """True if it is on its trajectory, driving or not."""
        return self.onboard.state in UNDER_WAY

    @property
    def progress_m(self) -> float:
        """Reported arc length; infinite once it is done."""
        return math.inf if self.onboard.state == TraversalStatus.DONE else self.furthest_m

    @property
    def assignment_statuses(self) -> list[AssignmentStatus]:
        """Status of its assignment, if it has one."""
        return [] if self.task is None else [AssignmentStatus(self.task, self.onboard.painted, self.progress_m)]

    @property
    def pose(self) -> tuple[float, float, float]:
        """Estimated pose: x (m), y (m), heading (rad)."""
        return self.onboard.estimate[:3]

    @property
    def waits(self) -> bool:
        """True if it stands, held or paused, or has nothing to do."""
        running = self.onboard.state == TraversalStatus.RUNNING
        return (self.onboard.held or not running) and abs(self.onboard.estimate.speed_mps) < RESTING_MPS

    def take(self, task: Assignment, taking: Taking) -> None:
        """Take an assignment; finished work is kept.

        Args:
            task: The assignment.
            taking: Way to get to its start.

        Raises:
            CommandRefused: The computer does not accept the plan.
        """
        self.conclude()
        self.emulator.load(task.plan.trajectory, task.share, taking=taking)
        if self.telemetry is not None:
            self._publish(self.telemetry.awake())
            self._publish(self.telemetry.loaded(task.plan.trajectory, task.share))
        self.task, self.until_m, self.furthest_m, self._authority_m = task, math.inf, 0.0, math.inf
        if self.listener is not None:
            self.stretch.take(task.plan.trajectory.path.segments, self.emulator.vehicle)

    def authorize(self, until_m: float) -> None:
        """Let it drive up to an arc length, at most its own `until_m`; a change is published."""
        authority_m = min(until_m, self.until_m)
        if authority_m != self._authority_m:
            self.emulator.authorize(authority_m)
            self._authority_m = authority_m

    def order(self, command: Callable[[], None]) -> None:
        """Carry out a command of its emulator and publish the changes."""
        command()
        if self.telemetry is not None:
            self._publish(self.telemetry.news())

    def _publish(self, payloads: list[Payload]) -> None:
        if self.listener is not None:
            self.listener(self.name, payloads)

    def _publish_claimed(self, path: NavPath) -> None:
        self._publish([(topics.CLAIMED, encode(path))])

    def claim(self, *, on_the_job: bool) -> None:
        """Claim its path from the passed part to the end of its authority, while it is on it."""
        ended = self.onboard.state in (TraversalStatus.DONE, TraversalStatus.ABORTED)
        if self.task is None or ended or not on_the_job:
            self.stretch.claim(*NOTHING)
        else:
            self.stretch.claim(self.furthest_m, min(self._authority_m, self.task.path.end_m))

    def conclude(self) -> None:
        """Put finished work aside."""
        if self.task is None:
            return
        self.works.append(Work(self.emulator.work.ledger, self.emulator.work.track))
        telemetry = self.telemetry or Telemetry(self.emulator)
        reports, reason = telemetry.final or telemetry.reports(), self.onboard.status.reason
        self.outcomes.append(Outcome(*reports, reason, 0.0, None, telemetry.strokes()))
        self.task = None

    def stop_between_swaths(self) -> None:
        """Stop at the next place where nothing is painted; a paused robot aborts where it stands."""
        if self.onboard.state == TraversalStatus.PAUSED:
            self.abort("others take over")
        elif self.task is not None and self.under_way:
            self.until_m = self.furthest_m if self.onboard.held else self.task.next_hold_m(self.furthest_m)

    def abort(self, why: str) -> None:
        """Abort the present assignment where the robot is."""
        self.order(partial(self.emulator.abort, why))

    def run_slice(self) -> Floats:
        """Run one slice; return (SLICE_TICKS, 3) true poses. A robot that is done stands still."""
        emulator, telemetry, rows = self.emulator, self.telemetry, self._rows
        poses: Floats = np.empty((SLICE_TICKS, 3))
        done = 0
        while done < SLICE_TICKS and emulator.active:
            most = SLICE_TICKS - done
            if telemetry is not None:
                rows, most = telemetry.rows, telemetry.until_due(most)
            count = self._runner.step(most, rows)
            poses[done : done + count] = rows[:count, tick_log.TRUTH : tick_log.TRUTH + 3]
            if rows[count - 1, tick_log.TICK] != emulator.tick_count:
                poses[done + count - 1] = emulator.world.pose
            if telemetry is not None:
                telemetry.hold(count)
            done += count
        if telemetry is not None and self.listener is None:
            telemetry.only_hashed()
        elif telemetry is not None:
            self._publish(telemetry.told())
        poses[done:] = emulator.world.pose
        if self.under_way:
            self.furthest_m = max(self.furthest_m, self.onboard.status.arc_length_m)
            self.ended_s = emulator.time_s
            self.waited_s += SLICE_TICKS / TICKS_PER_S * self.onboard.held
        return poses

    def stand_by(self, tick: int) -> None:
        """Stand until a tick: a robot that is done has stopped counting."""
        while self.emulator.tick_count < tick:
            self.emulator.tick()
            if self.telemetry is not None:
                self._publish(self.telemetry.after_tick())
