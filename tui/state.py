"""Console state, a pure reduction of a link's events."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.schemas import topics
from touchline.schemas.catalogue import parse_template
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages.base import Message
from touchline.schemas.messages.coverage_messages import MissedPatch
from touchline.schemas.messages.plan_messages import PlanReport
from touchline.schemas.messages.replay_messages import ReplayStatus
from touchline.schemas.messages.standard import DiagnosticArray, String
from touchline.schemas.messages.touchline import Event, PaintMarks, PauseStatus, Progress, TraversalStatus
from touchline.schemas.messages.turf_tank import Trajectory
from touchline.schemas.messages.viewing_messages import NavPath
from touchline.schemas.plain_text import plain
from touchline.schemas.replay_run import Belonging
from touchline.schemas.scenario import Origin
from touchline.schemas.setup import Setup
from touchline.schemas.spec import parse
from touchline.schemas.template import Template
from touchline.schemas.topics import Topic
from touchline.schemas.vehicles import Vehicle
from touchline.tui import robot as robot_model
from touchline.tui.event_log import ERROR, INFO, WARN, OperatorLog
from touchline.tui.goal_draft import GoalDraft
from touchline.tui.job import NOTHING, JobView, LineRow, PathView, TemplateView
from touchline.tui.node_health import Freshness, Node, take_report
from touchline.tui.obstacle_view import ObstacleView
from touchline.tui.order_registry import OrderRegistry
from touchline.tui.paint_track import PaintTrack
from touchline.tui.protocol import Incoming, Lost, NodeChanged, PaintFetched, Received, Rejected, Skimmed
from touchline.tui.replay_view import ReplayView
from touchline.tui.robot import BUSY_STATES, ROBOT_TOPICS, Robot, ShownPose, seconds
from touchline.tui.zone_outlines import NO_ZONES, ZoneOutlines

EXPECTED_NODES = (topics.PLANNER, topics.ROBOT_SIM, topics.BRIDGE)
"""Processes that are listed even before they appear."""
_MOST_SPEAKERS = 256
SEEN_S = 1.0
"""Sim time for which a report of obstacles or zones counts; a robot that sees sends five a second."""
SPEED_REPORT_S = 2.5
"""Maximum time until the robot reports a new speed factor; until then it may still report the old one."""


@dataclass
class ConsoleState:
    """State of one robot as the console shows it.

    Messages come in by `apply`, outcomes of the operator's orders by separate methods.

    `draft` is the job that is being prepared here, `loaded` the robot's, which is in view while the robot is busy, and
    whenever nothing is being prepared. `vehicle` is the robot's, once it has reported it.
    """

    name: str = ""
    """Namespace of the robot."""
    alone: bool = True
    """Whether the console knows no other robot."""
    closely: bool = True
    """Whether plan, paint and truth of the robot come in, not only what is shown of robots out of view."""
    robot: Robot = field(default_factory=Robot)
    last_pose: ShownPose | None = None
    """Last known pose of a robot that has gone."""
    lost_job: bool = False
    """Whether the robot's process ended while it was on a job, without another job since."""
    origin: Origin | None = None
    """Origin of its map frame, once it has reported it."""
    nodes: dict[str, Node] = field(default_factory=lambda: {name: Node(name) for name in EXPECTED_NODES})
    paint: PaintTrack = field(default_factory=PaintTrack)
    log: OperatorLog = field(default_factory=OperatorLog)
    orders: OrderRegistry = field(default_factory=OrderRegistry)
    draft: JobView = NOTHING
    loaded: JobView = NOTHING
    drive: GoalDraft = field(default_factory=GoalDraft)
    """Draft of a drive, besides the job that is being prepared."""
    replay: ReplayView = field(default_factory=ReplayView)
    progress: Progress | None = None
    plan_request: str = ""
    lost: int = 0
    rejected: int = 0
    now_s: float = 0.0
    """Time of the console, which stands still while the console does, so that nobody seems silent meanwhile."""
    vehicle: Vehicle = field(default_factory=Vehicle)
    vehicle_json: str = ""
    """The vehicle as text, for the planner; "" until the robot has reported it."""
    _speed_set: tuple[float, float] = (1.0, -math.inf)
    _publisher: str = ""
    _speakers: dict[str, tuple[str, ...]] = field(default_factory=dict)
    """Processes in the diagnostics of each publisher."""
    _rejected_topics: set[str] = field(default_factory=set)
    _known_job: JobView = NOTHING
    """Job that was loaded before a replay jumped: most likely it still is, and need not be laid out again."""

    # -- what is shown -----------------------------------------------------------------------------------------------

    @property
    def replayed(self) -> bool:
        """True if a replay stands in for the robot."""
        replay = self.nodes.get(topics.REPLAY)
        return replay is not None and replay.alive and not self.nodes[topics.ROBOT_SIM].alive

    @property
    def why_replayed(self) -> str:
        """Reason why a replayed robot takes no orders; "" for a real one."""
        return f"{self.name or 'the robot'} is a replay: there is no robot that could do it" if self.replayed else ""

    @property
    def robot_node(self) -> Node:
        """Process of the robot or its replay."""
        return self.nodes[topics.REPLAY if self.replayed else topics.ROBOT_SIM]

    @property
    def robot_alive(self) -> bool:
        """True if the robot is on the bus, or a replay of it."""
        return self.robot_node.alive

    @property
    def traversal(self) -> int | None:
        """State of the traversal; None until a living robot reports it."""
        status = self.robot.status
        return status.state if status and self.robot_alive else None

    @property
    def publisher(self) -> str:
        """Run of the robot's process that reports its status; "" if none has."""
        return self._publisher

    @property
    def robot_freshness(self) -> Freshness:
        """Freshness of the robot's messages."""
        return self.robot_node.freshness(self.now_s)

    @property
    def robot_silence_s(self) -> float:
        """Time (s) since the robot's last message."""
        return self.robot_node.silence_s(self.now_s)

    @property
    def robot_stale(self) -> bool:
        """True if the robot is present, but silent."""
        return self.robot_freshness is Freshness.STALE

    @property
    def paused_by_hand(self) -> bool:
        """True if the robot currently reports that a person has paused it."""
        return self.waits_for_person and self.robot.pause.cause == PauseStatus.OPERATOR

    @property
    def waits_for_person(self) -> bool:
        """True if the robot currently reports a pause that only a person ends."""
        pause = self.robot.pause
        known = pause.cause != PauseStatus.NONE and not pause.ends_by_itself
        return known and self.traversal == TraversalStatus.PAUSED and not self.robot_stale

    @property
    def moves_off_in_s(self) -> float | None:
        """Earliest time until the standing robot moves off by itself; None if it waits for a person.

        In seconds of wall-clock time, at the present pace of the robot's time.
        """
        robot, now_s = self.robot, self.robot.sim_time_s
        if self.traversal == TraversalStatus.PAUSED and robot.pause.ends_by_itself:
            earliest = robot.pause.earliest
        elif self.traversal == TraversalStatus.RUNNING and robot.warning.active:
            earliest = robot.warning.earliest
        else:
            return None
        left_s = seconds(earliest) - (now_s if now_s is not None else math.inf)
        if left_s <= 0.0 and self.traversal == TraversalStatus.RUNNING:
            return None
        return max(left_s, 0.0) / max(self.pace, 1e-3)

    @property
    def obstacles(self) -> tuple[ObstacleView, ...]:
        """Unknown and missing obstacles that the robot sees now, or saw when it was last heard."""
        now_s = self.robot.sim_time_s
        old = now_s is not None and now_s - self.robot.obstacles_s > SEEN_S
        return self.robot.obstacles if self.robot_alive and not old else ()

    @property
    def zones(self) -> ZoneOutlines:
        """Zones of the robot's protection now, or when it was last heard."""
        now_s = self.robot.sim_time_s
        old = now_s is not None and now_s - self.robot.zones_s > SEEN_S
        return self.robot.zones if self.robot_alive and not old else NO_ZONES

    @property
    def busy(self) -> bool:
        """True if the robot is on a job, so that another cannot be prepared in its view."""
        return self.traversal in BUSY_STATES

    @property
    def claimed(self) -> NDArray[np.float64] | None:
        """Points (n, 2) along the stretch of its path that others keep off, if any and if the job's leader is there."""
        leader = self.nodes.get(topics.OPERATOR)
        told_now = self.replayed or (leader is not None and leader.alive)
        return self.robot.claimed if told_now else None

    @property
    def share_done(self) -> float | None:
        """Covered share 0…1 of the job under way, or driven share of a drive; None without either."""
        status = self.robot.status
        if status is None or status.state in (TraversalStatus.IDLE, TraversalStatus.READY):
            return None
        share = status.coverage_pct / 100 if status.painted_ids else self.robot.driven_fraction
        return share if share is not None and math.isfinite(share) else None

    @property
    def guided(self) -> bool:
        """True if a team's coordinator guides the robot, which then drives no path."""
        return self.busy and self.robot.status is not None and self.robot.status.segment_count == 0

    @property
    def real_time_factor(self) -> float | None:
        """Sim seconds per wall second, as the robot measures it."""
        return self.robot_node.number("real_time_factor") if self.robot_alive else None

    @property
    def speed_factor(self) -> float | None:
        """Requested speed factor: the one that this console has just set, or else the robot's report."""
        if not self.robot_alive:
            return None
        factor, set_s = self._speed_set
        return factor if self.now_s - set_s < SPEED_REPORT_S else self.robot_node.number("speed_factor")

    @property
    def pace(self) -> float:
        """Sim time per wall time: the requested factor, or the measured one at maximum speed."""
        factor = self.speed_factor
        if factor is None or factor < 0.0:
            factor = self.real_time_factor
        return 1.0 if factor is None else factor

    @property
    def job(self) -> JobView:
        """Job in view."""
        return self.loaded if self.busy or self.draft is NOTHING else self.draft

    @property
    def template(self) -> TemplateView | None:
        """Template in view."""
        return self.job.template

    @property
    def path(self) -> PathView | None:
        """Path in view."""
        return self.job.path

    @property
    def path_loaded(self) -> bool:
        """True if the robot has the path in view, so that it can be started."""
        idle = self.traversal in (None, TraversalStatus.IDLE)
        return self.job is self.loaded and self.loaded.path is not None and not idle

    @property
    def worked_along(self) -> str:
        """Plural noun for what the robot works along."""
        return "swaths" if self.covers else "lines"

    @property
    def covers(self) -> bool:
        """True if the robot covers the areas of the template in view."""
        return bool(self.template and self.template.template.areas and self.vehicle.tool.covers)

    @property
    def rows(self) -> tuple[LineRow, ...]:
        """Segments to paint, in path order if there is a path."""
        if self.path:
            return self.path.rows
        return self.template.rows if self.template else ()

    @property
    def goal(self) -> str:
        """Id of the current line, "" without a job."""
        status = self.robot.status
        if not self.busy or status is None:
            return ""
        if self.path is None or status.segment_index >= len(self.path.goals):
            return status.segment_id
        goal = self.path.goals[status.segment_index]
        return self.path.rows[goal].segment_id if goal < len(self.path.rows) else ""

    # -- what comes in -----------------------------------------------------------------------------------------------

    def apply(self, event: Incoming, now_s: float) -> None:
        """Process one event; `now_s` is the console's time, which only measures silence."""
        self.now_s = now_s
        match event:
            case Received(topic, message, publisher):
                self._receive(topic, message, publisher)
            case Skimmed(_, publisher):
                for name in self._speakers.get(publisher, ()):
                    self.nodes[name].heard(now_s)
            case NodeChanged(node, alive):
                self._node_changed(node, alive)
            case PaintFetched(strokes):
                self.paint.fetched(strokes)
            case Lost(messages):
                self.lost = messages
            case Rejected(topic, reason):
                self._reject(topic, reason)

    def attend(self, *, closely: bool) -> None:
        """Note whether plan, paint and truth come in from now on; the paint so far is then requested."""
        self.closely = closely
        if closely:
            self.paint.request_fetch()

    def note(self, severity: int, source: str, text: str) -> None:
        """Write to the log at the robot's present time."""
        self.log.add(self.robot.sim_time_s, severity, source, text)

    def say(self, severity: int, text: str) -> None:
        """Show a message to the operator, in the row of the orders and in the log; toasts would cover other things."""
        text = plain(text)
        self.note(severity, "console", text)
        self.orders.say(severity, text, self.now_s)

    def _receive(self, topic: str, message: Message, publisher: str) -> None:
        heard = self.replay.hear(publisher)
        if heard is Belonging.VOID:
            return
        if heard is Belonging.JUMP:
            self._replay_jumped()
        if heard is Belonging.LIVE and topic == topics.STATUS.name and isinstance(message, TraversalStatus):
            self._robot_reported(message, publisher)
        try:
            if robot_model.take(self.robot, topic, message):
                self.robot_node.heard(self.now_s)
            elif isinstance(message, DiagnosticArray):
                self._diagnostics(message, publisher)
            elif topic in _HANDLERS:
                _HANDLERS[topic](self, message)
        except (TouchlineError, ValueError, AttributeError, TypeError, ArithmeticError) as error:
            self._reject(topic, str(error))

    def _robot_reported(self, message: TraversalStatus, publisher: str) -> None:
        """Process the status of a real robot."""
        if publisher and publisher != self._publisher:
            if self._publisher:
                self._robot_restarted()
            self._publisher = publisher
        self.orders.stop.status(message.state, publisher)
        self.lost_job &= message.state in (TraversalStatus.IDLE, TraversalStatus.ESTOPPED)

    def _replay_jumped(self) -> None:
        """Drop all state of the replay before a jump; the state at the new time follows."""
        self._known_job = self.loaded if self.loaded is not NOTHING else self._known_job
        self.robot, self.loaded = Robot(), NOTHING
        self.paint.clear()
        self.log.forget_replayed()

    def _node_changed(self, name: str, alive: bool) -> None:
        name = plain(name)
        node = self.nodes.setdefault(name, Node(name))
        if node.alive == alive:
            return
        back = alive and node.seen
        node.appeared(alive, self.now_s)
        if name not in (topics.CONSOLE, topics.OPERATOR, topics.OBSERVER):
            text = f"{name} is {'back' if back else 'up'}" if alive else f"{name} is down"
            self.note(INFO if alive or name == topics.REPLAY else ERROR, "console", text)
        if name == topics.ROBOT_SIM:
            if alive:
                self.paint.request_fetch()
            else:
                self._forget_robot()
        if name == topics.REPLAY:
            self._replay_changed(alive)
        if name == topics.PLANNER and not alive:
            self.progress = None

    def _replay_changed(self, alive: bool) -> None:
        """Process the beginning or end of a replay, after which only log entries remain."""
        if alive:
            self.paint.request_fetch()
        elif not self.nodes[topics.ROBOT_SIM].alive:
            self.robot, self.loaded, self.replay = Robot(), NOTHING, ReplayView()
            self.paint.clear()

    def _robot_restarted(self) -> None:
        self._forget_robot()
        self.note(WARN, "console", "robot restarted: g goes on with its job, l loads the plan anew")
        self.paint.request_fetch()

    def _forget_robot(self) -> None:
        self.last_pose = self.robot.pose or self.last_pose
        self.lost_job |= self.robot.status is not None and self.robot.status.state in BUSY_STATES
        self.robot = Robot()
        self.paint.clear()
        if self.closely and self.draft is NOTHING and not self.loaded.drives:  # what it had can be loaded again
            self.draft = self.loaded
        self.loaded = NOTHING

    def _reject(self, topic: str, reason: str) -> None:
        topic = plain(topic)
        self.rejected += 1
        if topic not in self._rejected_topics:
            self._rejected_topics.add(topic)
            self.note(WARN, "console", f"unreadable message on {topic}: {reason} (further ones are only counted)")

    def _diagnostics(self, message: DiagnosticArray, publisher: str) -> None:
        if len(self._speakers) >= _MOST_SPEAKERS:  # processes that come and go
            self._speakers.clear()
        self._speakers[publisher] = take_report(self.nodes, message, self.now_s)

    # -- outcomes of the operator's own orders -----------------------------------------------------------------------

    def choose_template(self, template: Template, text: str) -> None:
        """Begin to prepare a job for a template."""
        self.draft = JobView(TemplateView.of(template, text))

    def plan_done(self, request_id: str) -> None:
        """Note the answer to a plan request; later progress of it is ignored."""
        if request_id == self.plan_request:
            self.plan_request, self.progress = "", None

    def planned(self, trajectory: Trajectory, report: PlanReport) -> None:
        """Take a plan for the template in view.

        Raises:
            ValueError: The plan is not valid.
        """
        self.draft = JobView(self.template, PathView.of(trajectory, self.template, report))

    def handed_over(self) -> None:
        """Note that the robot has taken the job in view."""
        self.loaded, self.draft = self.job, NOTHING

    def speed_set(self, factor: float) -> None:
        """Note that the robot has taken a speed factor, which it will report later."""
        self._speed_set = (factor, self.now_s)

    # -- one handler per topic ---------------------------------------------------------------------------------------

    def _paint(self, message: PaintMarks) -> None:
        self.paint.add(message)

    def _template(self, message: String) -> None:
        template, path = None, self.loaded.path
        if message.data:
            known = self.loaded.template
            parsed = parse_template(message.data, "the robot's template")
            views = (known, self._known_job.template)
            same = next((view for view in views if view is not None and view.template == parsed), None)
            template = same or TemplateView.of(parsed, message.data)
        if path is not None and template is not self.loaded.template:
            path = PathView.of(path.trajectory, template, path.report)
        self.loaded = JobView(template, path)

    def _plan(self, message: Trajectory) -> None:
        known = self._known_job if self._known_job.template is self.loaded.template else NOTHING
        views = (self.loaded.path, known.path)
        path = next((view for view in views if view is not None and view.trajectory == message), None)
        before = self.loaded.path
        if path is None or path is not before:  # not the same once more
            self.paint.begin_drive(same_job=self.robot.take_plan(follows=before is not None))
        self.loaded = JobView(self.loaded.template, path or PathView.of(message, self.loaded.template))
        self.paint.request_fetch()

    def _claimed(self, message: NavPath) -> None:
        places = [(each.pose.position.x, each.pose.position.y) for each in message.poses]
        self.robot.claimed = np.array(places) if places else None

    def _setup(self, message: String) -> None:
        setup = parse(Setup, message.data, "the robot's setup")
        self.vehicle, self.origin = setup.vehicle, setup.scenario.origin
        self.vehicle_json = self.vehicle.model_dump_json()

    def _event(self, message: Event) -> None:
        at_s, source = seconds(message.header.stamp), message.source or "robot"
        self.log.add(at_s, message.severity, source, message.text, replayed=self.replayed)

    def _supervisor_event(self, message: Event) -> None:
        self.note(message.severity, message.source or topics.SUPERVISOR, message.text)

    def _replay_status(self, message: ReplayStatus) -> None:
        self.replay.status = message

    def _progress(self, message: Progress) -> None:
        if self.plan_request and message.request_id == self.plan_request and math.isfinite(message.fraction):
            self.progress = message.model_copy(update={"stage": plain(message.stage)})


def missed_patches(state: ConsoleState) -> tuple[MissedPatch, ...]:
    """Missed patches of a covering tool by the final report, the largest first."""
    report = state.robot.area_report
    return report.missed if report is not None and state.covers and state.job is state.loaded else ()


_HANDLERS: Mapping[str, Callable[[ConsoleState, Any], None]] = {
    topics.PAINT.name: ConsoleState._paint,
    topics.TEMPLATE.name: ConsoleState._template,
    topics.PLAN.name: ConsoleState._plan,
    topics.CLAIMED.name: ConsoleState._claimed,
    topics.SETUP.name: ConsoleState._setup,
    topics.EVENTS.name: ConsoleState._event,
    topics.SUPERVISOR_EVENTS.name: ConsoleState._supervisor_event,
    topics.PLANNER_PROGRESS.name: ConsoleState._progress,
    topics.REPLAY_STATUS.name: ConsoleState._replay_status,
}

CONSOLE_TOPICS: tuple[Topic, ...] = tuple(
    topics.TOPIC_BY_NAME[name] for name in (*ROBOT_TOPICS, *_HANDLERS, topics.DIAGNOSTICS.name)
)
"""Topics that a link has to subscribe to."""
