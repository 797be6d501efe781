"""Localization of a first difference to a component, with the recorded actuation applied."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Final, NamedTuple, Self

from touchline.checking.divergence import FOLLOWER, PARTS, Divergence, SessionDiff
from touchline.checking.open_loop_computer import OpenLoopComputer, decisions
from touchline.checking.rebuild import Rebuild
from touchline.checking.recorded_session import TICK_NS, RecordedSession
from touchline.checking.streamed_comparison import compare_streams
from touchline.recordings.recorded import Recorded
from touchline.schemas import topics

AFTER_TICKS: Final = 100
"""Ticks after the first difference in which its cause is searched."""


def first_differing_component(
    session: RecordedSession, first: Divergence, recorded: Iterable[Recorded], diff: SessionDiff
) -> str:
    """Return the component that causes a first difference.

    Args:
        session: The session to run again.
        first: Its first difference.
        recorded: Its messages.
        diff: A new exact comparison of a cut-off session.
    """
    last_tick = min(session.last_tick, round(100 * first.time_s) + AFTER_TICKS)
    short = replace(session, last_tick=last_tick)
    short.orders = [order for order in session.orders if order.tick <= last_tick]
    computer = OpenLoopComputer(session.setup, session.commands)
    until_ns = last_tick * TICK_NS
    among = (message for message in recorded if message.publish_time_ns <= until_ns)
    compare_streams(diff, Rebuild(short, computer), among, last_tick)
    seen = [_Seen.of(check.first) for check in diff.topics.values() if check.first is not None]
    own = decisions(computer, session, exact=True).first
    seen += [_Seen(FOLLOWER, own.time_s, own.time_s)] if own is not None else []
    if not seen:
        return first.part
    parts = {part: [each for each in seen if each.part == part] for part in PARTS}
    until_s = min(each.until_s for each in seen)
    return next((part for part, some in parts.items() if some and _may_be_first(some, until_s)), first.part)


class _Seen(NamedTuple):
    """Difference of a component, which began in some tick between two messages of the topic that shows it.

    Attributes:
        part: The component.
        from_s, until_s: The first and the last of these ticks, sim time.
    """

    part: str
    from_s: float
    until_s: float

    @classmethod
    def of(cls, found: Divergence) -> Self:
        """Create it from a topic's first difference."""
        rate_hz = topics.TOPIC_BY_NAME[found.topic].rate_hz
        between_s = 1.0 / rate_hz - 0.01 if rate_hz else 0.0
        return cls(found.part, round(found.time_s - between_s, 6), round(found.time_s, 6))


def _may_be_first(seen: Sequence[_Seen], until_s: float) -> bool:
    """Return whether differences of a component may have begun by then, when the first of all was seen.

    Topics of a component that are published seldom say little about when: the latest begin counts, unless the component
    itself shows the first difference.
    """
    return max(each.from_s for each in seen) <= until_s or min(each.until_s for each in seen) <= until_s
