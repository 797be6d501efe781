"""Reduction of a link's events to the state of the console: `apply_event`, and one function per topic."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from touchline.schemas import topics
from touchline.schemas.catalogue import parse_template
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages.base import Message
from touchline.schemas.messages.replay_messages import ReplayStatus
from touchline.schemas.messages.standard import DiagnosticArray, String
from touchline.schemas.messages.touchline import Event, PaintMarks, Progress, TraversalStatus
from touchline.schemas.messages.turf_tank import Trajectory
from touchline.schemas.messages.viewing_messages import NavPath
from touchline.schemas.plain_text import plain
from touchline.schemas.replay_run import Belonging
from touchline.schemas.setup import Setup
from touchline.schemas.spec import parse
from touchline.schemas.topics import Topic
from touchline.tui import robot as robot_model
from touchline.tui.event_log import ERROR, INFO, WARN
from touchline.tui.job import NOTHING, JobView, PathView, TemplateView
from touchline.tui.node_health import Node, take_report
from touchline.tui.protocol import Incoming, LinkChanged, Lost, NodeChanged, PaintFetched, Received, Rejected, Skimmed
from touchline.tui.replay_view import ReplayView
from touchline.tui.robot import BUSY_STATES, ROBOT_TOPICS, Robot, seconds
from touchline.tui.state import ConsoleState

_MOST_SPEAKERS = 256


def apply_event(state: ConsoleState, event: Incoming, now_s: float) -> None:
    """Process one event; `now_s` is the console's time, which only measures silence."""
    state.now_s = now_s
    match event:
        case Received(topic, message, publisher):
            _receive(state, topic, message, publisher)
        case Skimmed(_, publisher):
            for name in state.speakers.get(publisher, ()):
                state.nodes[name].heard(now_s)
        case NodeChanged(node, alive):
            _node_changed(state, node, alive)
        case LinkChanged(linked, why):
            lost = f"no link to the router: {why}" if why else "no link to the router, which reaches all others"
            text = "linked to the router again" if linked else lost
            state.note(INFO if linked else ERROR, "console", text)
        case PaintFetched(strokes):
            state.paint.fetched(strokes)
        case Lost(messages):
            state.lost = messages
        case Rejected(topic, reason):
            _reject(state, topic, reason)


def _receive(state: ConsoleState, topic: str, message: Message, publisher: str) -> None:
    heard = state.replay.hear(publisher)
    if heard is Belonging.VOID:
        return
    if heard is Belonging.JUMP:
        _replay_jumped(state)
    if heard is Belonging.LIVE and topic == topics.STATUS.name and isinstance(message, TraversalStatus):
        _robot_reported(state, message, publisher)
    try:
        if robot_model.take(state.robot, topic, message):
            state.robot_node.heard(state.now_s)
        elif isinstance(message, DiagnosticArray):
            _diagnostics(state, message, publisher)
        elif topic in _HANDLERS:
            _HANDLERS[topic](state, message)
    except (TouchlineError, ValueError, AttributeError, TypeError, ArithmeticError) as error:
        _reject(state, topic, str(error))


def _robot_reported(state: ConsoleState, message: TraversalStatus, publisher: str) -> None:
    """Process the status of a real robot."""
    if publisher and publisher != state.publisher:
        if state.publisher:
            _robot_restarted(state)
        state.publisher = publisher
    state.orders.stop.status(message.state, publisher)
    state.lost_job &= message.state in (TraversalStatus.IDLE, TraversalStatus.ESTOPPED)


def _replay_jumped(state: ConsoleState) -> None:
    """Drop all state of the replay before a jump; the state at the new time follows."""
    state.known_job = state.loaded if state.loaded is not NOTHING else state.known_job
    state.robot, state.loaded = Robot(), NOTHING
    state.paint.clear()
    state.log.forget_replayed()


def _node_changed(state: ConsoleState, name: str, alive: bool) -> None:
    name = plain(name)
    node = state.nodes.setdefault(name, Node(name))
    if node.alive == alive:
        return
    back = alive and node.seen
    node.appeared(alive, state.now_s)
    if name not in (topics.CONSOLE, topics.OPERATOR, topics.OBSERVER):
        text = f"{name} is {'back' if back else 'up'}" if alive else f"{name} is down"
        state.note(INFO if alive or name == topics.REPLAY else ERROR, "console", text)
    if name == topics.ROBOT_SIM:
        if alive:
            state.paint.request_fetch()
        else:
            _forget_robot(state)
    if name == topics.REPLAY:
        _replay_changed(state, alive)
    if name == topics.PLANNER and not alive:
        state.progress = None


def _replay_changed(state: ConsoleState, alive: bool) -> None:
    """Process the beginning or end of a replay, after which only log entries remain."""
    if alive:
        state.paint.request_fetch()
    elif not state.nodes[topics.ROBOT_SIM].alive:
        state.robot, state.loaded, state.replay = Robot(), NOTHING, ReplayView()
        state.paint.clear()


def _robot_restarted(state: ConsoleState) -> None:
    _forget_robot(state)
    state.note(WARN, "console", "robot restarted: g goes on with its job, l loads the plan anew")
    state.paint.request_fetch()


def _forget_robot(state: ConsoleState) -> None:
    state.last_pose = state.robot.pose or state.last_pose
    state.lost_job |= state.robot.status is not None and state.robot.status.state in BUSY_STATES
    state.robot = Robot()
    state.paint.clear()
    if state.closely and state.draft is NOTHING and not state.loaded.drives:  # what it had can be loaded again
        state.draft = state.loaded
    state.loaded = NOTHING


def _reject(state: ConsoleState, topic: str, reason: str) -> None:
    topic = plain(topic)
    state.rejected += 1
    if topic not in state.rejected_topics:
        state.rejected_topics.add(topic)
        state.note(WARN, "console", f"unreadable message on {topic}: {reason} (further ones are only counted)")


def _diagnostics(state: ConsoleState, message: DiagnosticArray, publisher: str) -> None:
    if len(state.speakers) >= _MOST_SPEAKERS:  # processes that come and go
        state.speakers.clear()
    state.speakers[publisher] = take_report(state.nodes, message, state.now_s)


def _paint(state: ConsoleState, message: PaintMarks) -> None:
    state.paint.add(message)


def _template(state: ConsoleState, message: String) -> None:
    template, path = None, state.loaded.path
    if message.data:
        known = state.loaded.template
        parsed = parse_template(message.data, "the robot's template")
        views = (known, state.known_job.template)
        same = next((view for view in views if view is not None and view.template == parsed), None)
        template = same or TemplateView.of(parsed, message.data)
    if path is not None and template is not state.loaded.template:
        path = PathView.of(path.trajectory, template, path.report)
    state.loaded = JobView(template, path)


def _plan(state: ConsoleState, message: Trajectory) -> None:
    known = state.known_job if state.known_job.template is state.loaded.template else NOTHING
    views = (state.loaded.path, known.path)
    path = next((view for view in views if view is not None and view.trajectory == message), None)
    before = state.loaded.path
    if path is None or path is not before:  # not the same once more
        state.paint.begin_drive(same_job=state.robot.take_plan(follows=before is not None))
    state.loaded = JobView(state.loaded.template, path or PathView.of(message, state.loaded.template))
    state.paint.request_fetch()


def _claimed(state: ConsoleState, message: NavPath) -> None:
    places = [(each.pose.position.x, each.pose.position.y) for each in message.poses]
    state.robot.claimed = np.array(places) if places else None


def _setup(state: ConsoleState, message: String) -> None:
    setup = parse(Setup, message.data, "the robot's setup")
    state.vehicle, state.origin = setup.vehicle, setup.scenario.origin
    state.vehicle_json = state.vehicle.model_dump_json()


def _event(state: ConsoleState, message: Event) -> None:
    at_s, source = seconds(message.header.stamp), message.source or "robot"
    state.log.add(at_s, message.severity, source, message.text, replayed=state.replayed)


def _supervisor_event(state: ConsoleState, message: Event) -> None:
    state.note(message.severity, message.source or topics.SUPERVISOR, message.text)


def _replay_status(state: ConsoleState, message: ReplayStatus) -> None:
    state.replay.status = message


def _progress(state: ConsoleState, message: Progress) -> None:
    if state.plan_request and message.request_id == state.plan_request and math.isfinite(message.fraction):
        state.progress = message.model_copy(update={"stage": plain(message.stage)})


_HANDLERS: Mapping[str, Callable[[ConsoleState, Any], None]] = {
    topics.PAINT.name: _paint,
    topics.TEMPLATE.name: _template,
    topics.PLAN.name: _plan,
    topics.CLAIMED.name: _claimed,
    topics.SETUP.name: _setup,
    topics.EVENTS.name: _event,
    topics.SUPERVISOR_EVENTS.name: _supervisor_event,
    topics.PLANNER_PROGRESS.name: _progress,
    topics.REPLAY_STATUS.name: _replay_status,
}

CONSOLE_TOPICS: tuple[Topic, ...] = tuple(
    topics.TOPIC_BY_NAME[name] for name in (*ROBOT_TOPICS, *_HANDLERS, topics.DIAGNOSTICS.name)
)
"""Topics that a link has to subscribe to."""
