"""State of one robot as the console shows it, and what follows from it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from touchline.schemas import topics
from touchline.schemas.messages.coverage_messages import MissedPatch
from touchline.schemas.messages.plan_messages import PlanReport
from touchline.schemas.messages.touchline import PauseStatus, Progress, TraversalStatus
from touchline.schemas.messages.turf_tank import Trajectory
from touchline.schemas.plain_text import plain
from touchline.schemas.scenario import Origin
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.tui.event_log import OperatorLog
from touchline.tui.goal_draft import GoalDraft
from touchline.tui.job import NOTHING, JobView, LineRow, PathView, TemplateView
from touchline.tui.node_health import Freshness, Node
from touchline.tui.obstacle_view import ObstacleView
from touchline.tui.order_registry import OrderRegistry
from touchline.tui.paint_track import PaintTrack
from touchline.tui.replay_view import ReplayView
from touchline.tui.robot import BUSY_STATES, Robot, ShownPose, seconds
from touchline.tui.zone_outlines import NO_ZONES, ZoneOutlines

EXPECTED_NODES = (topics.PLANNER, topics.ROBOT_SIM, topics.BRIDGE)
"""Processes that are listed even before they appear."""
SEEN_S = 1.0
"""Sim time for which a report of obstacles or zones counts; a robot that sees sends five a second."""
SPEED_REPORT_S = 2.5
"""Maximum time until the robot reports a new speed factor; until then it may still report the old one."""


@dataclass
class ConsoleState:
    """State of one robot as the console shows it.

    Messages come in by `reduction.apply_event`, outcomes of the operator's orders by methods.

    `draft` is the job that is being prepared here, `loaded` the robot's, which is in view while the robot is busy, and
    whenever nothing is being prepared. `vehicle` is the robot's, once it has reported it.
    """

    name: str = ""
    """Namespace of the robot."""
    alone: bool = True
    """True if the console knows no other robot."""
    closely: bool = True
    """True if plan, paint and truth of the robot come in, not only what is shown of robots out of view."""
    robot: Robot = field(default_factory=Robot)
    last_pose: ShownPose | None = None
    """Last known pose of a robot that has gone."""
    lost_job: bool = False
    """True if the robot's process ended while it was on a job, without another job since."""
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
    publisher: str = ""
    """Run of the robot's process that reports its status; "" if none has."""
    speakers: dict[str, tuple[str, ...]] = field(default_factory=dict)
    """Processes in the diagnostics of each publisher."""
    rejected_topics: set[str] = field(default_factory=set)
    """Topics with unreadable messages, each of which is logged once."""
    known_job: JobView = NOTHING
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


def missed_patches(state: ConsoleState) -> tuple[MissedPatch, ...]:
    """Missed patches of a covering tool by the final report, the largest first."""
    report = state.robot.area_report
    return report.missed if report is not None and state.covers and state.job is state.loaded else ()
