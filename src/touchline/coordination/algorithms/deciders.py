"""Deciders: one algorithm for all robots of a team, or one for each, asked for wishes once per update.

Whatever an algorithm does, each robot has a wish that can be followed: after a wrong answer it holds until the next
update, after three in a row until the run ends. The first answer may take as long as it needs; others that are late are
not waited for.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping
from typing import Any, Protocol

from touchline.coordination.algorithms.algorithm_loading import Make
from touchline.coordination.algorithms.answers import (
    WRONG_SHAPE,
    AnswerBook,
    WrongAnswer,
    checked_message,
    checked_wish,
    in_shape,
)
from touchline.coordination.algorithms.asking import Asker
from touchline.coordination.algorithms.peer_radio import PeerRadio, RadioFigures
from touchline.coordination.algorithms.team_algorithm import HOLD, Team, Wish


class Decider(Protocol):
    """Decides what each robot wishes.

    Attributes:
        books: Wrong answers of each robot's algorithm, by name.
        radio_figures: Figures of the radio; None without one.
    """

    books: defaultdict[str, AnswerBook]

    @property
    def radio_figures(self) -> RadioFigures | None:
        """Figures of the radio between robots, if there is one."""
        ...

    def wishes(self, now: Team) -> dict[str, Wish]:
        """Return the wish of each robot; to be called once per update."""
        ...


class CentralDecider:
    """Decider with one algorithm for all."""

    radio_figures = None

    def __init__(self, algorithm: Any) -> None:
        """Ask an algorithm from now on."""
        self._algorithm, self._begun, self._asker = algorithm, False, Asker()
        self.books: defaultdict[str, AnswerBook] = defaultdict(AnswerBook)

    def wishes(self, now: Team) -> dict[str, Wish]:
        """Return wishes, as of `Decider`."""
        most_s = next(iter(now.robots.values())).period_s if self._begun else math.inf
        self._begun = True
        try:
            found = self._asker.ask(lambda: self._algorithm.decide(now), most_s)
            answers = in_shape(lambda: _by_name(found, now))
        except WrongAnswer as error:
            for name in now.robots:
                self.books[name].wrong(error, now.now_s)
            return dict.fromkeys(now.robots, HOLD)
        return {name: self._wish(name, answers.get(name, HOLD), now) for name in now.robots}

    def _wish(self, name: str, answer: Any, now: Team) -> Wish:
        return _checked(answer, self.books[name], now, name)


def _by_name(answers: Any, now: Team) -> dict[str, Any]:
    """Return answers by the names of robots.

    Raises:
        WrongAnswer: They are none.
    """
    if not isinstance(answers, Mapping):
        raise WrongAnswer(
            WRONG_SHAPE, f"{type(answers).__name__} is no mapping of names to wishes, and it has no `heard`"
        )
    if unknown := [name for name in answers if name not in now.robots]:
        raise WrongAnswer(WRONG_SHAPE, f"{unknown[0]!r:.40} is no robot of the team")
    return dict(answers)


class RobotDeciders:
    """Decider with one algorithm for each robot, which hear of each other by radio."""

    def __init__(self, make: Make, radio: PeerRadio) -> None:
        """Make an algorithm for each robot when it is first asked.

        Args:
            make: Makes one.
            radio: Radio between them.
        """
        self._make, self._radio = make, radio
        self._algorithms: dict[str, Any] = {}
        self._askers: defaultdict[str, Asker] = defaultdict(Asker)
        self.books: defaultdict[str, AnswerBook] = defaultdict(AnswerBook)

    @property
    def radio_figures(self) -> RadioFigures:
        """Figures of the radio."""
        return self._radio.figures

    def wishes(self, now: Team) -> dict[str, Wish]:
        """Return wishes, as of `Decider`."""
        found: dict[str, Wish] = {}
        messages: dict[str, bytes] = {}
        for name in now.robots:
            found[name], message = self._asked(name, now)
            if message is not None:
                messages[name] = message
        self._radio.exchange(now.now_s, messages, {name: complex(me.x_m, me.y_m) for name, me in now.robots.items()})
        return found

    def _asked(self, name: str, now: Team) -> tuple[Wish, bytes | None]:
        """Return a robot's wish and message."""
        book, me, ask = self.books[name], now.robots[name], self._askers[name].ask
        if book.dismissed:
            return HOLD, None
        most_s = me.period_s if name in self._algorithms else math.inf
        try:
            if name not in self._algorithms:
                algorithm = self._algorithms[name] = ask(self._make, math.inf)
                ask(lambda: algorithm.start(me), math.inf)
            answer = ask(lambda: self._heard_and_decided(name, now), most_s)
            wish, payload = in_shape(lambda: _pair(answer))
            message = checked_message(payload)
        except WrongAnswer as error:
            book.wrong(error, now.now_s)
            return HOLD, None
        return _checked(wish, book, now, name), message

    def _heard_and_decided(self, name: str, now: Team) -> Any:
        algorithm = self._algorithms[name]
        for sender, payload, age_s in self._radio.received(name, now.now_s):
            algorithm.heard(sender, payload, age_s)
        return algorithm.decide(now.robots[name])


def _pair(answer: Any) -> tuple[Any, Any]:
    """Return a wish and a message.

    Raises:
        WrongAnswer: It is no such pair.
    """
    if not isinstance(answer, tuple) or len(answer) != 2:
        raise WrongAnswer(WRONG_SHAPE, f"{type(answer).__name__} is no pair of a wish and a message")
    return answer[0], answer[1]


def _checked(answer: Any, book: AnswerBook, now: Team, name: str) -> Wish:
    """Return an answer as a wish; to hold if it is a wrong one, or its robot has given too many."""
    if book.dismissed:
        return HOLD
    try:
        wish, clipped = checked_wish(answer, now.robots[name])
    except WrongAnswer as error:
        book.wrong(error, now.now_s)
        return HOLD
    book.right()
    if clipped:
        book.clipped(now.now_s)
    return wish
