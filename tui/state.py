"""Console state: a pure reduction of a link's events."""

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
from touchline.tui.order_book import OrderBook
from touchline.tui.paint_track import PaintTrack
from touchline.tui.protocol import Incoming, Lost, NodeChanged, PaintFetched, Received, Rejected, Skimmed
from touchline.tui.replay_view import ReplayView
from touchline.tui.robot import BUSY_STATES, ROBOT_TOPICS, Robot, ShownPose, seconds

EXPECTED_NODES = (topics.PLANNER, topics.ROBOT_SIM, topics.BRIDGE)
"""Processes that are listed even before they have ever been seen."""
_MOST_SPEAKERS = 256
SPEED_TOLD_S = 2.5
"""How long the robot may take to tell a new speed factor; until then it may still tell the old one."""


@dataclass
class ConsoleState:
    """Everything the console shows of one robot.

    Messages come in by `apply`; what came of the operator's orders by its own methods.

    `draft` is the job that is being prepared here, `loaded` the one that the robot has. The robot's is in view while
    it is busy, and whenever nothing is being prepared. `vehicle` is the robot's,
    once it has told.
    """

    name: str = ""
    """The robot's namespace."""
    alone: bool = True
    """Whether the console knows no other robot."""
    closely: bool = True
    """Whether plan, paint and truth of the robot come in, or only what is shown of one among others."""
    robot: Robot = field(default_factory=Robot)
    last_pose: ShownPose | None = None
    """Where a robot that has gone was when it was heard last."""
    lost_job: bool = False
    """Whether the robot's process ended while it was on a job, and it has not been given another since."""
    origin: Origin | None = None
    """Of its map frame, once it has told."""
    nodes: dict[str, Node] = field(default_factory=lambda: {name: Node(name) for name in EXPECTED_NODES})
    paint: PaintTrack = field(default_factory=PaintTrack)
    log: OperatorLog = field(default_factory=OperatorLog)
    orders: OrderBook = field(default_factory=OrderBook)
    draft: JobView = NOTHING
    loaded: JobView = NOTHING
    drive: GoalDraft = field(default_factory=GoalDraft)
    """Beside the job that is being prepared."""
    replay: ReplayView = field(default_factory=ReplayView)
    progress: Progress | None = None
    plan_request: str = ""
    lost: int = 0
    rejected: int = 0
    now_s: float = 0.0
    """The console's own time: it stands still while the console does, so that nobody else seems silent for that."""
    vehicle: Vehicle = field(default_factory=Vehicle)
    vehicle_json: str = ""
    """The same as text, for the planner; "" as long as the robot has not told."""
    _speed_set: tuple[float, float] = (1.0, -math.inf)
    _publisher: str = ""
    _speakers: dict[str, tuple[str, ...]] = field(default_factory=dict)
    """Which processes a publisher of diagnostics tells of."""
    _rejected_topics: set[str] = field(default_factory=set)
    _known_job: JobView = NOTHING
    """What was loaded before a replay jumped: most likely it still is, and need not be laid out again."""

    # -- what is shown -----------------------------------------------------------------------------------------------

    @property
    def replayed(self) -> bool:
        """Whether it is a replay that speaks for the robot, which itself is not there."""
        replay = self.nodes.get(topics.REPLAY)
        return replay is not None and replay.alive and not self.nodes[topics.ROBOT_SIM].alive

    @property
    def why_replayed(self) -> str:
        """Why the robot takes no orders, if it is replayed; "" if it may."""
        return f"{self.name or 'the robot'} is a replay: there is no robot that could do it" if self.replayed else ""

    @property
    def robot_node(self) -> Node:
        """The process that speaks for the robot."""
        return self.nodes[topics.REPLAY if self.replayed else topics.ROBOT_SIM]

    @property
    def robot_alive(self) -> bool:
        """Whether the robot is on the bus, or a replay of it."""
        return self.robot_node.alive

    @property
    def traversal(self) -> int | None:
        """The traversal's state; None while no living robot has told it."""
        status = self.robot.status
        return status.state if status and self.robot_alive else None

    @property
    def publisher(self) -> str:
        """The run of the robot's process that tells its status; "" if none has."""
        return self._publisher

    @property
    def robot_freshness(self) -> Freshness:
        """Whether what the robot has said holds now."""
        return self.robot_node.freshness(self.now_s)

    @property
    def robot_silence_s(self) -> float:
        """How long nothing has been heard of the robot."""
        return self.robot_node.silence_s(self.now_s)

    @property
    def robot_stale(self) -> bool:
        """Whether the robot is there, but says nothing any more."""
        return self.robot_freshness is Freshness.STALE

    @property
    def paused_by_hand(self) -> bool:
        """Whether the robot reports, and reports now, that a person has paused it."""
        return self.waits_for_person and self.robot.pause.cause == PauseStatus.OPERATOR

    @property
    def waits_for_person(self) -> bool:
        """Whether the robot reports, and reports now, a pause that only a person ends."""
        pause = self.robot.pause
        known = pause.cause != PauseStatus.NONE and not pause.ends_by_itself
        return known and self.traversal == TraversalStatus.PAUSED and not self.robot_stale

    @property
    def moves_off_in_s(self) -> float | None:
        """Time until the standing robot moves off by itself at the earliest; None if it waits for a person.

        In seconds of wall-clock time, as long as the robot's time passes at its present pace.
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
    def busy(self) -> bool:
        """Whether the robot is on a job, so that another cannot be prepared in its view."""
        return self.traversal in BUSY_STATES

    @property
    def claimed(self) -> NDArray[np.float64] | None:
        """(n, 2) along the stretch of its path that others keep off, if it has one and who leads the job is there."""
        leader = self.nodes.get(topics.OPERATOR)
        told_now = self.replayed or (leader is not None and leader.alive)
        return self.robot.claimed if told_now else None

    @property
    def share_done(self) -> float | None:
        """Covered share 0…1 of the job under way, or driven share of a drive; None of neither."""
        status = self.robot.status
        if status is None or status.state in (TraversalStatus.IDLE, TraversalStatus.READY):
            return None
        share = status.coverage_pct / 100 if status.painted_ids else self.robot.driven_fraction
        return share if share is not None and math.isfinite(share) else None

    @property
    def guided(self) -> bool:
        """Whether a team's coordinator guides the robot, which then drives no path."""
        return self.busy and self.robot.status is not None and self.robot.status.segment_count == 0

    @property
    def real_time_factor(self) -> float | None:
        """Sim seconds per wall second, as the robot measures it."""
        return self.robot_node.number("real_time_factor") if self.robot_alive else None

    @property
    def speed_factor(self) -> float | None:
        """The speed factor asked for: what this console has just set, or else what the robot tells once a second."""
        if not self.robot_alive:
            return None
        factor, set_s = self._speed_set
        return factor if self.now_s - set_s < SPEED_TOLD_S else self.robot_node.number("speed_factor")

    @property
    def pace(self) -> float:
        """Sim time per wall time, as far as is known: the factor asked for, or what comes of as fast as it goes."""
        factor = self.speed_factor
        if factor is None or factor < 0.0:
            factor = self.real_time_factor
        return 1.0 if factor is None else factor

    @property
    def job(self) -> JobView:
        """The job in view."""
        return self.loaded if self.busy or self.draft is NOTHING else self.draft

    @property
    def template(self) -> TemplateView | None:
        """The template in view."""
        return self.job.template

    @property
    def path(self) -> PathView | None:
        """The path in view."""
        return self.job.path

    @property
    def path_loaded(self) -> bool:
        """Whether the robot has the path in view, so that it can be started."""
        idle = self.traversal in (None, TraversalStatus.IDLE)
        return self.job is self.loaded and self.loaded.path is not None and not idle

    @property
    def worked_along(self) -> str:
        """What the robot works along, for people, in the plural."""
        return "swaths" if self.covers else "lines"

    @property
    def covers(self) -> bool:
        """Whether it is the areas of the template in view that the robot works on, with a tool that covers them."""
        return bool(self.template and self.template.template.areas and self.vehicle.tool.covers)

    @property
    def rows(self) -> tuple[LineRow, ...]:
        """The segments to paint, in path order if there is a path."""
        if self.path:
            return self.path.rows
        return self.template.rows if self.template else ()

    @property
    def goal(self) -> str:
        """Id of the line being painted or driven to, empty when the robot is on no job."""
        status = self.robot.status
        if not self.busy or status is None:
            return ""
        if self.path is None or status.segment_index >= len(self.path.goals):
            return status.segment_id
        goal = self.path.goals[status.segment_index]
        return self.path.rows[goal].segment_id if goal < len(self.path.rows) else ""

    # -- what comes in -----------------------------------------------------------------------------------------------

    def apply(self, event: Incoming, now_s: float) -> None:
        """Take one event; `now_s` is the console's own time, used to notice silence only."""
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
        """Plan, paint and truth come in from now on, or no longer; what was painted meanwhile is asked for."""
        self.closely = closely
        if closely:
            self.paint.request_fetch()

    def note(self, severity: int, source: str, text: str) -> None:
        """Write to the log at the robot's present time; the log makes it plain."""
        self.log.add(self.robot.sim_time_s, severity, source, text)

    def _receive(self, topic: str, message: Message, publisher: str) -> None:
        heard = self.replay.hear(publisher)
        if heard is Belonging.VOID:
            return
        if heard is Belonging.JUMP:
            self._replay_jumped()
        if heard is Belonging.LIVE and topic == topics.STATUS.name and isinstance(message, TraversalStatus):
            self._robot_told(message, publisher)
        try:
            if robot_model.take(self.robot, topic, message):
                self.robot_node.heard(self.now_s)
            elif isinstance(message, DiagnosticArray):
                self._diagnostics(message, publisher)
            elif topic in _HANDLERS:
                _HANDLERS[topic](self, message)
        except (TouchlineError, ValueError, AttributeError, TypeError, ArithmeticError) as error:
            self._reject(topic, str(error))

    def _robot_told(self, message: TraversalStatus, publisher: str) -> None:
        """The robot itself, and no replay, has told its state."""
        if publisher and publisher != self._publisher:
            if self._publisher:
                self._robot_restarted()
            self._publisher = publisher
        self.orders.stop.status(message.state, publisher)
        self.lost_job &= message.state in (TraversalStatus.IDLE, TraversalStatus.ESTOPPED)

    def _replay_jumped(self) -> None:
        """Nothing holds that was replayed before; what holds at the new time comes now."""
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
        """A replay has begun, or has ended: of that nothing is left but what was said."""
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
        """Begin to prepare a job."""
        self.draft = JobView(TemplateView.of(template, text))

    def plan_done(self, request_id: str) -> None:
        """A request to plan is answered: what is still on its way of its progress comes too late."""
        if request_id == self.plan_request:
            self.plan_request, self.progress = "", None

    def planned(self, trajectory: Trajectory, report: PlanReport) -> None:
        """Take a plan for the template in view. Raises ValueError when it makes no sense."""
        self.draft = JobView(self.template, PathView.of(trajectory, self.template, report))

    def handed_over(self) -> None:
        """The robot has taken the job in view."""
        self.loaded, self.draft = self.job, NOTHING

    def speed_set(self, factor: float) -> None:
        """The robot has taken a speed factor; it will say so itself in a while."""
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
    """The patches that a covering tool has left out by the report of the job's end, the largest first."""
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
"""What a link has to listen to."""
