"""A team over the bus: records, sets the pace, gives the coordinator its task, follows to the end, reports."""

from __future__ import annotations

import json
import math
import time
import uuid
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from touchline.bus import Bus, Inbox
from touchline.coordination.algorithms.wish_figures import why_held
from touchline.coordination.body_contacts import BodyContacts, body_radius_m
from touchline.coordination.dispatch.dispatch_figures import dispatch_figures, why_not_dispatched
from touchline.coordination.late_robots import NOT_WAITED_FOR
from touchline.coordination.reported_contacts import ReportedContacts
from touchline.coordination.start_poses import free_area
from touchline.jobs.recording.team_recording import begin_team_recording, end_team_recording
from touchline.jobs.team.contact_order import ContactsInOrder
from touchline.jobs.team.team_figures import hash_of
from touchline.jobs.watcher import JobFailed, Watcher
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.team import TeamScenario

_COORDINATOR_S: Final = 120.0
_CALL_S: Final = 10.0
_BEGIN_S: Final = 120.0
"""Timeout, s: all robots are asked one by one."""
_STALLED_S: Final = 20.0
_LATCHED: Final = "emergency-stopped"
"""Event code of a latched robot: its traversal does not end, so there will be no report."""


@dataclass
class TeamOnBus:
    """A team's run in progress.

    Attributes:
        buses: Buses of the robots, by name.
        team: The team.
        watcher: Observer of the run.
        speed: Sim seconds per wall second; negative for as fast as possible.
        record: File to record to, if any.
    """

    buses: dict[str, Bus]
    team: TeamScenario
    watcher: Watcher
    speed: float
    record: Path | None = None
    _reports: dict[str, m.TraversalReport] = field(default_factory=dict, init=False)
    _stopped: dict[str, str] = field(default_factory=dict, init=False)
    _status: m.TeamStatus = field(default=m.TeamStatus(), init=False)
    _report: m.TeamReport = field(default=m.TeamReport(), init=False)
    _queue: dict[str, Any] = field(default_factory=dict, init=False)
    _warnings: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        """Create the counter of contacts."""
        self._told = ReportedContacts(self.buses, body_radius_m(self.team.vehicle), free_area(self.team))
        self._ways = ContactsInOrder(self._told, len(self.buses))

    def run(self) -> dict[str, Any]:
        """Do the whole run.

        Returns:
            The run's report.

        Raises:
            JobFailed: A service refused, died, or the team stands still.
            CallError: A service did not answer.
        """
        first = next(iter(self.buses.values()))
        coordinator = first.of(topics.TEAM_NAMESPACE)
        setup = coordinator.inbox([topics.TEAM_SETUP], keep="latest")
        self._wait_for(setup)
        inboxes = [bus.inbox([topics.REPORT, topics.EVENTS, topics.TRUE_WAY]) for bus in self.buses.values()]
        statuses = coordinator.inbox([topics.TEAM_STATUS, topics.TEAM_REPORT, topics.TEAM_QUEUE], keep="latest")
        events = coordinator.inbox([topics.EVENTS])
        if self.record is not None:
            begin_team_recording(first, self.record, self.watcher)
        for bus in self.buses.values():
            self._set_speed(bus)
        self.watcher.stage("Team")
        begun = time.monotonic()
        self._begin(coordinator)
        self._follow(inboxes, statuses, events)
        wall_s = time.monotonic() - begun
        recorded = end_team_recording(first, self.record, self.watcher) if self.record is not None else None
        return self._figures(wall_s, recorded, first)

    def _wait_for(self, setup: Inbox) -> None:
        """Wait until the coordinator serves: then it publishes its team."""
        self.watcher.stage("Starting")
        deadline = time.monotonic() + _COORDINATOR_S
        while not setup.drain():
            if time.monotonic() > deadline:
                raise JobFailed(f"the coordinator is not ready after {_COORDINATOR_S:.0f} s")
            self.watcher.check()
            time.sleep(0.01)

    def _set_speed(self, bus: Bus) -> None:
        request = m.SetSpeedRequest(request_id=_new_id(), factor=self.speed)
        response = bus.call(topics.SET_SPEED, request, _CALL_S, self.watcher.check)
        if not response.success:
            raise JobFailed(response.message)

    def _begin(self, coordinator: Bus) -> None:
        request = m.TeamTaskRequest(request_id=_new_id(), task_json=self.team.task.model_dump_json())
        response = coordinator.call(topics.TEAM_TASK, request, _BEGIN_S, self.watcher.check)
        if not response.success:
            raise JobFailed(response.message)

    def _follow(self, inboxes: list[Inbox], statuses: Inbox, events: Inbox) -> None:
        """Wait until every robot has reported."""
        updates, moved_at = -1, time.monotonic()
        while not set(self.buses) <= set(self._reports) | set(self._stopped):
            self.watcher.check()
            for name, inbox in zip(self.buses, inboxes, strict=True):
                self._hear(name, inbox)
            self._ways.look()
            for _, message in events.messages():
                if isinstance(message, m.Event):
                    self._warnings += message.code == NOT_WAITED_FOR
                    self.watcher.event(message.severity, f"{topics.COORDINATOR}: {message.text}")
            for _, message in statuses.messages():
                if isinstance(message, m.TeamStatus):
                    self._status = message
                elif isinstance(message, m.TeamReport):
                    self._report = message
                elif isinstance(message, m.String):
                    self._queue = json.loads(message.data)
            if self._status.updates != updates:
                updates, moved_at = self._status.updates, time.monotonic()
                self._report_progress()
            elif time.monotonic() - moved_at > _STALLED_S:
                missing = [name for name in self.buses if name not in self._reports and name not in self._stopped]
                raise JobFailed(f"nothing has happened for {_STALLED_S:.0f} s; {', '.join(missing[:5])} drive no more")
            time.sleep(0.01)

    def _hear(self, name: str, inbox: Inbox) -> None:
        for _, message in inbox.messages():
            if isinstance(message, m.TraversalReport):
                self._reports[name] = message
            elif isinstance(message, m.TrueWay):
                self._ways.take(name, message)
            elif isinstance(message, m.Event) and message.severity >= m.Event.WARN:
                if message.code == _LATCHED:
                    self._stopped[name] = message.text
                self.watcher.event(message.severity, f"{name}: {message.text}")

    def _report_progress(self) -> None:
        status, done = self._status, self._status.updates * self.team.update_s / self.team.duration_s
        text = status.problem or f"{status.robots} robots, {status.arrived} arrived, {status.stuck} stuck"
        self.watcher.progress(min(done, 1.0), text)

    def _figures(self, wall_s: float, recording: dict[str, Any] | None, bus: Bus) -> dict[str, Any]:
        self._ways.look(complete=True)
        contacts = self._told.contacts
        sim_s = max((report.total_time_s for report in self._reports.values()), default=0.0)
        stopped = self._stopped
        lacks = recording is not None and not recording["complete"]
        wishes = json.loads(self._report.wishes_json) if self._report.wishes_json else {}
        problem = "the recording is not complete" if lacks else why_held(wishes) or self._why_not(contacts)
        return {
            "success": not stopped and not problem,
            "reason": next(iter(stopped.values()), problem),
            "team": self.team.name,
            "robots": len(self.buses),
            "task": self.team.task.kind,
            "seed": self.team.world.seed,
            "time_s": sim_s,
            "contacts": len(contacts.pairs) + len(contacts.at_walls),
            "contacts_with_walls": len(contacts.at_walls),
            "closest_m": contacts.closest_m if math.isfinite(contacts.closest_m) else None,
            "updates": self._status.updates,
            "robots_not_waited_for": self._warnings,
            "arrived": self._status.arrived,
            "missing": list(self._report.missing),
            "cost_of_squares": self._status.cost_of_squares,
            "stopped": stopped,
            **({"dispatch": dispatch_figures(self._queue)} if self._queue else {}),
            **wishes,
            "bus": {"received": bus.counters.received, "lost": bus.counters.lost},
            "recording": recording,
            "real_time_factor": sim_s / wall_s,
            "wall_time_s": wall_s,
            "hash": hash_of({name: report.session_hash for name, report in sorted(self._reports.items())}),
        }

    def _why_not(self, contacts: BodyContacts) -> str:
        """Return why a run has failed: a contact, or a task or goal that was not reached; without safety never."""
        if self.team.avoid == "none":
            return ""
        if touched := _touched(contacts):
            return touched
        if self.team.faulty:
            return ""
        if self._queue:
            return why_not_dispatched(self._queue)
        missing = self._report.missing
        return f"{len(missing)} robots have not arrived: {'; '.join(missing[:5])}" if missing else ""


def _touched(contacts: BodyContacts) -> str:
    between, walls = len(contacts.pairs), len(contacts.at_walls)
    shown = (f"{between} contacts" if between else "", f"{walls} contacts with walls" if walls else "")
    return ", ".join(filter(None, shown))


def _new_id() -> str:
    return uuid.uuid4().hex
