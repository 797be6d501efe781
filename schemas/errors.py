"""Errors that reach a person: each says what is wrong, where, and what to do about it."""

from collections.abc import Sequence
from typing import Final

#: Further problems of one text that are shown beside the first.
MOST_OTHERS: Final = 19


class TouchlineError(Exception):
    """Base of every error that Touchline raises on purpose."""


class MissingExtra(TouchlineError, ImportError):
    """A feature needs packages that are not installed; the text names them."""


class SpecError(TouchlineError):
    """A template, vehicle or scenario that cannot be used.

    Args:
        source: File name or other origin of the text.
        field: Path of the offending field, such as ``segments[3].arc.sweep_angle``; empty for the whole file.
        problem: What is wrong, as a predicate: ``"is nan"``.
        remedy: What is allowed or how to mend it.
        others: Further problems of the same text, a line each.
    """

    def __init__(self, source: str, field: str, problem: str, remedy: str, others: Sequence[str] = ()) -> None:
        self.source, self.field, self.problem, self.remedy = source, field, problem, remedy
        place = f"{source}: {field}" if field else source
        shown = [f"{source}: {line}" for line in others[:MOST_OTHERS]]
        if len(others) > MOST_OTHERS:
            shown.append(f"{source}: {len(others) - MOST_OTHERS} more problems")
        super().__init__("\n".join((f"{place} {problem}; {remedy}", *shown)))


class PlanningError(TouchlineError):
    """A template that is well formed but cannot be driven.

    Args:
        segment_id: Segment concerned; empty when the whole plan is.
        problem: What is wrong, as a predicate.
        remedy: How to mend it.
    """

    def __init__(self, segment_id: str, problem: str, remedy: str) -> None:
        self.segment_id, self.problem, self.remedy = segment_id, problem, remedy
        place = f'segment "{segment_id}"' if segment_id else "plan"
        super().__init__(f"{place} {problem}; {remedy}")


class NothingReachedError(PlanningError):
    """A template without a line that is within reach: there is nothing to wait for where things stand."""


class CommandRefused(TouchlineError):
    """A command that cannot be carried out in the present state; the text is the reason."""


class PayloadError(TouchlineError):
    """Bytes that are not the message they should be; nothing was taken from them."""
