"""Lets a recording and what is made of it today go on side by side, so that little of either has to be kept."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from touchline.checking.divergence import SessionDiff
from touchline.checking.rebuild import Rebuild
from touchline.checking.recorded_session import TICK_NS
from touchline.recordings.channels import topic_at
from touchline.recordings.recorded import Recorded
from touchline.services.robot_sim.packing import Payload

Progress = Callable[[float], None]
"""Told the fraction done."""


def let_both_go_on(
    diff: SessionDiff,
    rebuild: Rebuild,
    recorded: Iterable[Recorded],
    last_tick: int,
    progress: Progress = lambda done: None,
) -> None:
    """Compare all that is recorded with all that is said today.

    Args:
        diff: Takes both.
        rebuild: Says what is said today.
        recorded: In the order in which it was.
        last_tick: Of the session.
        progress: See `Progress`.
    """
    messages = iter(recorded)
    told_ns, ahead = -1, next(messages, None)
    for payloads in rebuild.said():
        diff.said(payloads)
        told_ns = max(told_ns, rebuild.tick * TICK_NS)
        while ahead is not None and ahead.log_time_ns <= told_ns:
            _take(diff, ahead)
            ahead = next(messages, None)
        progress(rebuild.tick / max(last_tick, 1))
    if ahead is not None:
        _take(diff, ahead)
    compare_rest(diff, messages, [])


def compare_rest(diff: SessionDiff, recorded: Iterable[Recorded], said: Iterable[list[Payload]]) -> None:
    """Take all that is left of both; nothing more comes."""
    for payloads in said:
        diff.said(payloads)
    for message in recorded:
        _take(diff, message)
    diff.end()


def _take(diff: SessionDiff, message: Recorded) -> None:
    topic = topic_at(message.topic)
    if topic is not None and topic.name in diff.wanted:
        diff.recorded(topic, message)
