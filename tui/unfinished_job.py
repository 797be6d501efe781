"""Descriptions of the unfinished job that the robot could continue."""

from __future__ import annotations

import math

from touchline.schemas.messages.touchline import TraversalStatus, UnfinishedJob
from touchline.schemas.plain_text import plain
from touchline.tui import format
from touchline.tui.state import ConsoleState

OFFERED_STATES = (TraversalStatus.IDLE, TraversalStatus.READY, TraversalStatus.DONE, TraversalStatus.ABORTED)


def offered(state: ConsoleState) -> UnfinishedJob | None:
    """Unfinished job that the robot can continue now; None if there is none."""
    job = state.robot.unfinished
    if job is None or job.total_length_m == 0.0 or state.replayed or state.robot_stale:
        return None
    return job if state.traversal in OFFERED_STATES else None


def next_step(state: ConsoleState) -> UnfinishedJob | None:
    """Unfinished job, if continuing it is the next step: no plan is loaded and no other job is being prepared."""
    job = offered(state)
    if job is None or state.traversal == TraversalStatus.READY:
        return None
    chosen = state.draft.template
    return job if chosen is None or chosen.template.name == job.name else None


def share_done(state: ConsoleState, job: UnfinishedJob) -> str:
    """Format the share of a job that is done: `14 % painted`."""
    share = job.done_pct / 100.0
    if not math.isfinite(share):
        return "begun"
    tool = state.vehicle.tool
    done = "painted" if tool.paints else "covered" if tool.covers else "driven"
    return f"{format.percent(math.floor(100.0 * share) / 100.0)} {done}"


def name_of(job: UnfinishedJob) -> str:
    """Name of a job for people."""
    return plain(job.name) or "a plan without a name"
