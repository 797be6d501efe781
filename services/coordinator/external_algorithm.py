"""Algorithm of a team in processes of others, asked over the bus: any language, one process for all robots or one each.

Each robot's question is JSON on its own `algorithm/state`, the answer JSON on its `algorithm/wish`
(docs/guides/team-algorithms.md); what it says to others goes by the same radio as for objects in this process.
"""

from __future__ import annotations

import json
import time
from collections import defaultdict
from collections.abc import Mapping
from typing import Any, Final

from touchline.bus import Bus
from touchline.coordination.algorithms.answers import (
    LATE,
    WRONG_SHAPE,
    AnswerBook,
    WrongAnswer,
    checked_message,
    checked_wish,
    in_shape,
)
from touchline.coordination.algorithms.peer_radio import PeerRadio, RadioFigures
from touchline.coordination.algorithms.team_algorithm import (
    HOLD,
    GoalWish,
    Me,
    PathWish,
    Team,
    TwistWish,
    VelocityWish,
    Wish,
)
from touchline.schemas import messages as m
from touchline.schemas import topics

_LOOK_S: Final = 0.0005
_PAIRS: Final[Mapping[str, Any]] = {"velocity": VelocityWish, "twist": TwistWish, "goal": GoalWish}


class ExternalDecider:
    """Decider that asks whoever answers on the bus."""

    def __init__(self, buses: Mapping[str, Bus], radio: PeerRadio) -> None:
        """Ask from now on.

        Args:
            buses: Buses of the robots, by name.
            radio: Radio between them.
        """
        self._radio = radio
        self._questions = {name: bus.publisher(topics.ALGORITHM_STATE) for name, bus in buses.items()}
        self._answers = {name: bus.inbox([topics.ALGORITHM_WISH]) for name, bus in buses.items()}
        self._known: set[str] = set()
        self._update = 0
        self.books: defaultdict[str, AnswerBook] = defaultdict(AnswerBook)

    @property
    def radio_figures(self) -> RadioFigures:
        """Figures of the radio."""
        return self._radio.figures

    def wishes(self, now: Team) -> dict[str, Wish]:
        """Return wishes, as of `Decider`; a robot of whose algorithm nothing has been heard yet holds."""
        self._update += 1
        asked = {name: me for name, me in now.robots.items() if not self.books[name].dismissed}
        for name, me in asked.items():
            self._questions[name].send(m.String(data=json.dumps(self._question(me))))
        answers = self._collected(asked, next(iter(now.robots.values())).period_s)
        found: dict[str, Wish] = dict.fromkeys(now.robots, HOLD)
        said: dict[str, bytes] = {}
        for name, me in asked.items():
            if name not in self._known:
                continue
            try:
                found[name], message = self._read(name, answers.get(name), me, now.now_s)
            except WrongAnswer as error:
                self.books[name].wrong(error, now.now_s)
            else:
                said |= {name: message} if message is not None else {}
        self._radio.exchange(now.now_s, said, {name: complex(me.x_m, me.y_m) for name, me in now.robots.items()})
        return found

    def _question(self, me: Me) -> dict[str, Any]:
        heard = [
            {"from": sender, "age_s": age_s, "text": payload.decode(errors="replace")}
            for sender, payload, age_s in self._radio.received(me.name, me.now_s)
        ]
        rings = me.area.shape.exterior, *me.area.shape.interiors
        fields = {field: value for field, value in vars(me).items() if field != "area"}
        return {
            "update": self._update,
            **fields,
            "heard": heard,
            "area": [[(x, y) for x, y, *_ in ring.coords] for ring in rings],
        }

    def _collected(self, asked: Mapping[str, Me], most_s: float) -> dict[str, dict[str, Any]]:
        """Return the answers to the last questions that come in time, by robot."""
        found: dict[str, dict[str, Any]] = {}
        until_s = time.monotonic() + most_s
        while True:
            for name in asked:
                for _, message in self._answers[name].messages():
                    self._known.add(name)
                    answer = _parsed(message)
                    if answer.get("update", self._update) == self._update:
                        found[name] = answer
            waited_for = self._known.intersection(asked) if self._known else asked
            if all(name in found for name in waited_for) or time.monotonic() >= until_s:
                return found
            time.sleep(_LOOK_S)

    def _read(self, name: str, answer: dict[str, Any] | None, me: Me, now_s: float) -> tuple[Wish, bytes | None]:
        """Return a robot's wish, and what it says to others.

        Raises:
            WrongAnswer: There is no answer, or none that can be followed.
        """
        if answer is None:
            raise WrongAnswer(LATE, f"none within {me.period_s:g} s")
        wish, clipped = checked_wish(_wish(answer.get("wish")), me)
        text = answer.get("say")
        if not (text is None or isinstance(text, str)):
            raise WrongAnswer(WRONG_SHAPE, f"say is {type(text).__name__}, not text")
        said = checked_message(None if text is None else in_shape(text.encode))
        book = self.books[name]
        book.right()
        if clipped:
            book.clipped(now_s)
        return wish, said


def _parsed(message: m.Message) -> dict[str, Any]:
    """Return an answer; empty if it is no JSON object."""
    try:
        found = json.loads(message.data) if isinstance(message, m.String) else None
    except (ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def _wish(given: Any) -> Any:
    """Return a wish of its JSON: ``"hold"``, ``{"velocity": [x, y]}``, ``twist``, ``goal`` or ``path``.

    Raises:
        WrongAnswer: It is none.
    """
    if given == "hold":
        return HOLD
    if isinstance(given, dict) and len(given) == 1:
        ((kind, numbers),) = given.items()
        if kind == "path":
            return PathWish(numbers)
        if kind in _PAIRS and isinstance(numbers, list) and len(numbers) == 2:
            return _PAIRS[kind](*numbers)
    raise WrongAnswer(WRONG_SHAPE, f"{json.dumps(given):.60} is no wish")
