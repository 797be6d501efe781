"""Answers of algorithms, which may be anything: checked before a robot follows them."""

from __future__ import annotations

import math
import traceback
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any, Final, TypeVar

import numpy as np

from touchline.coordination.algorithms.team_algorithm import (
    HOLD,
    MOST_BYTES,
    GoalWish,
    Hold,
    Me,
    PathWish,
    TwistWish,
    VelocityWish,
    Wish,
)
from touchline.schemas.errors import TouchlineError

T = TypeVar("T")

NOT_FINITE: Final = "not-finite"
WRONG_SHAPE: Final = "wrong-shape"
LATE: Final = "late"
RAISED: Final = "raised"
TOO_LONG: Final = "message-too-long"
TOO_FAST: Final = "too-fast"
FAR_OUTSIDE: Final = "far-outside"
REASONS: Final = {
    NOT_FINITE: "a number of its wish is not finite",
    WRONG_SHAPE: "its answer is not of the kind that is asked for",
    LATE: "it took longer than an update to answer",
    RAISED: "it raised an exception",
    TOO_LONG: f"its message is longer than {MOST_BYTES:,} bytes",
    TOO_FAST: "it wished for more than the largest speed, and was slowed down to that",
    FAR_OUTSIDE: "it wished for a place farther outside of the area than that is large",
}
"""Wrong answers, by the code that reports name them by."""
_MOST_POINTS: Final = 10_000
"""Points of a path."""
_APART_M: Final = 1e-6
"""Least distance of two successive points of a path."""
_MOST_RADPS: Final = 100.0
"""Largest yaw rate that is passed on: no robot turns as fast."""
MOST_WRONG: Final = 3
"""Wrong answers in a row after which a robot holds until the run ends."""


class WrongAnswer(TouchlineError):
    """Answer that cannot be followed.

    Attributes:
        code: One of `REASONS`.
        detail: What is wrong with this one.
    """

    def __init__(self, code: str, detail: str = "") -> None:
        """Tell by a code and, where it helps, a detail what is wrong."""
        self.code, self.detail = code, detail
        super().__init__(f"{REASONS[code]}{f': {detail}' if detail else ''}")


class AnswerBook:
    """Wrong answers of one robot's algorithm.

    Attributes:
        counts: How often each code of `REASONS` came up.
        first: The first wrong answer in words; empty if there is none.
        dismissed: Whether its robot holds from now on.
    """

    def __init__(self) -> None:
        """Start without any."""
        self.counts: Counter[str] = Counter()
        self.first, self.dismissed = "", False
        self._in_a_row = 0

    def right(self) -> None:
        """Count an answer that can be followed."""
        self._in_a_row = 0

    def wrong(self, error: WrongAnswer, now_s: float) -> None:
        """Count one that cannot.

        Args:
            error: What is wrong with it.
            now_s: Time since the team began.
        """
        self.counts[error.code] += 1
        self.first = self.first or f"at {now_s:.1f} s {error}"
        self._in_a_row += 1
        self.dismissed = self._in_a_row >= MOST_WRONG

    def clipped(self, now_s: float) -> None:
        """Count a wish for more than the largest speed."""
        self.counts[TOO_FAST] += 1
        self.first = self.first or f"at {now_s:.1f} s {REASONS[TOO_FAST]}"


def in_shape(check: Callable[[], T]) -> T:
    """Return the result of looking at an answer, which may raise anything.

    Raises:
        WrongAnswer: It did.
    """
    try:
        return check()
    except WrongAnswer:
        raise
    except Exception as error:
        raise WrongAnswer(WRONG_SHAPE, in_words(error)) from error


def checked_wish(answer: Any, me: Me) -> tuple[Wish, bool]:
    """Return an answer as a wish that can be followed, and whether it had to be slowed down.

    Args:
        answer: Anything.
        me: The robot that is to follow it.

    Raises:
        WrongAnswer: It is no wish, has numbers that are not finite, or leads far out of the area.
    """
    return in_shape(lambda: _checked_wish(answer, me))


def _checked_wish(answer: Any, me: Me) -> tuple[Wish, bool]:
    speed_max_mps = me.speed_max_mps
    match answer:
        case Hold():
            return HOLD, False
        case GoalWish():
            return GoalWish(*_near(_finite(answer.x_m, answer.y_m), me)), False
        case VelocityWish():
            x, y = _finite(answer.x_mps, answer.y_mps)
            slower = _slower(math.hypot(x, y), speed_max_mps)
            return VelocityWish(x * slower, y * slower), slower < 1.0
        case TwistWish():
            speed, rate = _finite(answer.speed_mps, answer.yaw_rate_radps)
            slower, slow_rate = _slower(abs(speed), speed_max_mps), min(max(rate, -_MOST_RADPS), _MOST_RADPS)
            return TwistWish(speed * slower, slow_rate), slower < 1.0 or slow_rate != rate
        case PathWish():
            points = [_near(_finite(*_pair(point)), me) for point in _listed(answer.points_m)]
            return PathWish(_apart(points)), False
    raise WrongAnswer(WRONG_SHAPE, f"{type(answer).__name__} is no wish")


def checked_message(payload: Any) -> bytes | None:
    """Return a message that can be sent, or None.

    Raises:
        WrongAnswer: It is not bytes, or too many.
    """
    return in_shape(lambda: _checked_message(payload))


def _checked_message(payload: Any) -> bytes | None:
    if payload is not None and not isinstance(payload, bytes):
        raise WrongAnswer(WRONG_SHAPE, f"its message is {type(payload).__name__}, not bytes")
    if payload is not None and len(payload) > MOST_BYTES:
        raise WrongAnswer(TOO_LONG, f"{len(payload):,}")
    return payload


def in_words(error: BaseException) -> str:
    """Return an exception's type and text, even if that cannot be had."""
    return traceback.format_exception_only(error)[-1].strip()


def _near(place: tuple[float, float], me: Me) -> tuple[float, float]:
    """Return a place (m).

    Raises:
        WrongAnswer: It is farther outside of the area than that is large.
    """
    low_x, low_y, high_x, high_y = me.area.shape.bounds
    most_m = math.hypot(high_x - low_x, high_y - low_y)
    off_m = max(low_x - place[0], place[0] - high_x, low_y - place[1], place[1] - high_y)
    if off_m > most_m:
        raise WrongAnswer(FAR_OUTSIDE, f"{place[0]:g}, {place[1]:g}")
    return place


def _slower(speed_mps: float, most_mps: float) -> float:
    """Return the factor that brings a speed down to the largest."""
    return most_mps / speed_mps if speed_mps > most_mps * (1.0 + 1e-9) else 1.0


def _apart(points: Sequence[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    """Return a path's points but those that are next to the one before: lines of no length have no direction."""
    kept = [points[0]]
    for point in points[1:]:
        if math.dist(point, kept[-1]) >= _APART_M:
            kept.append(point)
    return tuple(kept)


def _listed(points: Any) -> list[Any]:
    """Return a path's points.

    Raises:
        WrongAnswer: They are no sequence, none at all, or too many.
    """
    if not isinstance(points, Sequence | np.ndarray) or not 1 <= len(points) <= _MOST_POINTS:
        raise WrongAnswer(WRONG_SHAPE, f"a path is a sequence of 1 to {_MOST_POINTS:,} points")
    return list(points)


def _pair(point: Any) -> tuple[Any, Any]:
    """Return x and y of a point.

    Raises:
        WrongAnswer: It does not have two numbers.
    """
    try:
        x, y = point
    except (TypeError, ValueError) as error:
        raise WrongAnswer(WRONG_SHAPE, f"{point!r:.40} is no point x, y") from error
    return x, y


def _finite(*numbers: Any) -> tuple[float, float]:
    """Return two numbers.

    Raises:
        WrongAnswer: One is no number, or not finite.
    """
    try:
        x, y = (float(number) for number in numbers)
    except (TypeError, ValueError, OverflowError) as error:
        raise WrongAnswer(WRONG_SHAPE, str(error)) from error
    if not (math.isfinite(x) and math.isfinite(y)):
        raise WrongAnswer(NOT_FINITE, f"{x:g}, {y:g}")
    return x, y
