"""Second run of a session that differs, to draw it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from touchline.checking.check_files import SessionVerdict
from touchline.checking.component_replay import ESTIMATES, OPEN_LOOP, decided_again, estimated_again
from touchline.checking.decision_plots import decision_plots
from touchline.checking.difference_plots import Plot, estimate_plots, plan_view, plots_of
from touchline.checking.difference_traces import DifferenceTraces, way_of
from touchline.checking.divergence import ESTIMATOR, FOLLOWER, PLAN, Divergence, SessionDiff
from touchline.checking.rebuild import Rebuild
from touchline.checking.recorded_session import RecordedSession
from touchline.checking.replan import planned_again
from touchline.checking.robot_messages import RobotMessages
from touchline.recordings.channels import topic_at
from touchline.schemas import topics
from touchline.schemas.errors import TouchlineError
from touchline.services.robot_sim.packing import Payload


def drawn_differences(only: str, task: tuple[int, SessionVerdict]) -> tuple[int, list[Plot]]:
    """Run `draw_differences` for a verdict at its place among others."""
    place, verdict = task
    return place, draw_differences(only, verdict)


def lost_drawing(task: tuple[int, SessionVerdict], _why: str) -> tuple[int, list[Plot]]:
    """Return no plots for a drawing whose process died."""
    place, _ = task
    return place, []


def draw_differences(only: str, verdict: SessionVerdict) -> list[Plot]:
    """Return plots of a session that differs; none if it cannot be run again.

    Args:
        only: Component that was run alone; "" for the whole robot.
        verdict: Its verdict.
    """
    if verdict.first is None:
        return []
    messages = RobotMessages(Path(verdict.path), verdict.robot, verdict.process)
    try:
        if only == ESTIMATOR:
            return estimate_plots(_estimates(messages, verdict.first))
        session = messages.session()
        found = _plans(session) if verdict.part == PLAN else []
        if only == PLAN:
            return found
        if only == FOLLOWER:
            return decision_plots(
                session, decided_again(session, messages, SessionDiff(topics_recorded=())), verdict.first
            )
        traces = DifferenceTraces(verdict.first, session.last_tick / 100.0)
        for payloads in Rebuild(session).messages():
            traces.take(1, payloads)
        traces.take(0, _payloads(messages))
        return found + plots_of(traces)
    except (TouchlineError, OSError):  # it could be run a moment ago; the verdict stands without pictures
        return []


def _estimates(messages: RobotMessages, first: Divergence) -> DifferenceTraces:
    """Return recorded and present estimates, both beside the recorded truth."""
    recorded = messages.tables(OPEN_LOOP | {topics.TRUTH.name})
    session, output = estimated_again(recorded)
    recorded = recorded.since(session.since)
    traces = DifferenceTraces(first, session.last_tick / 100.0)
    truth = [(topics.TRUTH, each.payload) for each in recorded.messages({topics.TRUTH.name})]
    then = recorded.messages(ESTIMATES)
    traces.take(0, [*truth, *((topic, each.payload) for each in then if (topic := topic_at(each.topic)) is not None)])
    traces.take(1, truth)
    for part in output:
        traces.take(1, ((topic, payload) for topic, payloads in part for payload in payloads.each()))
    return traces


def _payloads(messages: RobotMessages) -> Iterator[Payload]:
    for message in messages:
        if (topic := topic_at(message.topic)) is not None:
            yield topic, message.payload


def _plans(session: RecordedSession) -> list[Plot]:
    """Plot each driven plan, and the present one."""
    found = []
    for number, job in enumerate(session.jobs, 1):
        made = planned_again(job, session.setup.vehicle)
        if made is not None and made != job.trajectory:
            which = f" {number}" if len(session.jobs) > 1 else ""
            found.append(Plot(f"Plan{which}", plan_view(way_of(job.trajectory), way_of(made))))
    return found
