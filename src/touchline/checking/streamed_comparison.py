"""Parallel run of a recording and its rebuild, so that little of either has to be kept."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from touchline.checking.divergence import SessionDiff
from touchline.checking.rebuild import Rebuild
from touchline.checking.recorded_session import TICK_NS
from touchline.recordings.channels import topic_at
from touchline.recordings.recorded import Recorded
from touchline.services.robot_sim.packing import Payload

Progress = Callable[[float], None]
"""Called with the fraction done."""


def compare_streams(
    diff: SessionDiff,
    rebuild: Rebuild,
    recorded: Iterable[Recorded],
    last_tick: int,
    progress: Progress = lambda done: None,
) -> None:
    """Compare all recorded messages with all present ones.

    Args:
        diff: Comparison that takes both.
        rebuild: Source of the present messages.
        recorded: Recorded messages, in order.
        last_tick: Last tick of the session.
        progress: Called with the fraction done.
    """
    messages = iter(recorded)
    sent_ns, ahead = -1, next(messages, None)
    for payloads in rebuild.messages():
        diff.present(payloads)
        sent_ns = max(sent_ns, rebuild.tick * TICK_NS)
        while ahead is not None and ahead.log_time_ns <= sent_ns:
            _take(diff, ahead)
            ahead = next(messages, None)
        progress(rebuild.tick / max(last_tick, 1))
    if ahead is not None:
        _take(diff, ahead)
    compare_rest(diff, messages, [])


def compare_rest(diff: SessionDiff, recorded: Iterable[Recorded], messages: Iterable[list[Payload]]) -> None:
    """Take all remaining messages of both and end the comparison."""
    for payloads in messages:
        diff.present(payloads)
    for message in recorded:
        _take(diff, message)
    diff.end()


def _take(diff: SessionDiff, message: Recorded) -> None:
    topic = topic_at(message.topic)
    if topic is not None and topic.name in diff.wanted:
        diff.recorded(topic, message)
