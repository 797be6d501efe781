"""Questions to algorithms, in threads: one that has no answer in time is not waited for, and others are asked on."""

from __future__ import annotations

import threading
from collections.abc import Callable
from queue import Empty, SimpleQueue
from time import perf_counter
from typing import Any, Final, TypeVar

from touchline.coordination.algorithms.answers import LATE, RAISED, WrongAnswer, in_words
from touchline.schemas.plugins import log_plugin_error

T = TypeVar("T")

_LOOK_S: Final = 0.05
"""Wall-clock time between two looks at the clock while an answer is waited for."""


class _Thread:
    """Thread that answers one question after another.

    Attributes:
        questions: To be answered.
        answers: Answers, or the exceptions instead.
    """

    def __init__(self) -> None:
        self.questions: SimpleQueue[Callable[[], Any]] = SimpleQueue()
        self.answers: SimpleQueue[tuple[Any, BaseException | None]] = SimpleQueue()
        threading.Thread(target=self._work, name="algorithm", daemon=True).start()

    def _work(self) -> None:
        while True:
            question = self.questions.get()
            try:
                self.answers.put((question(), None))
            except BaseException as error:  # noqa: BLE001, whatever somebody else's code raises
                log_plugin_error("the team's algorithm failed")
                self.answers.put((None, error))


_idle: list[_Thread] = []


class Asker:
    """Questions to one algorithm, which is asked nothing further before it has ended what it was asked."""

    def __init__(self) -> None:
        """Begin without a question."""
        self._late: _Thread | None = None

    def ask(self, question: Callable[[], T], most_s: float) -> T:
        """Return the answer to a question.

        Raises:
            WrongAnswer: It raised an exception, or takes too long.
        """
        if self._late is not None:
            if self._late.answers.empty():
                raise WrongAnswer(LATE, "it has not ended an earlier one")
            self._late.answers.get()
            _idle.append(self._late)
            self._late = None
        thread = _idle.pop() if _idle else _Thread()
        begun_s = perf_counter()
        thread.questions.put(question)
        while (answered := _taken(thread)) is None:
            if perf_counter() - begun_s > most_s:
                self._late = thread
                raise WrongAnswer(LATE, f"none within {most_s:g} s")
        _idle.append(thread)
        found, error = answered
        if error is not None:
            raise WrongAnswer(RAISED, in_words(error)) from error
        if (took_s := perf_counter() - begun_s) > most_s:
            raise WrongAnswer(LATE, f"{took_s:.2f} s, of {most_s:g} s")
        answer: T = found
        return answer


def _taken(thread: _Thread) -> tuple[Any, BaseException | None] | None:
    """Return a thread's answer, if it comes in a moment."""
    try:
        return thread.answers.get(timeout=_LOOK_S)
    except Empty:
        return None
