"""Takeover of a team whose coordinator is lost: robots say which plans they follow, and obey this one from then on.

Nothing that the former coordinator knew is believed. By answering, a robot refuses everything of former coordinators,
late or repeated. Until all robots have answered, nobody gets a plan: each stands at the end of its own. By cells a
robot forgets its cell as it answers, and brakes.
"""

from __future__ import annotations

import time
import uuid
from collections.abc import Mapping
from typing import Final

import numpy as np

from touchline.bus import Bus
from touchline.bus.calls import Question
from touchline.coordination.plans.plan_hub import FollowedPlan
from touchline.core.timed_motion import COLUMNS
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import decode, encode
from touchline.schemas.errors import PayloadError

_ANSWER_S: Final = 0.25
"""Wall-clock time for an answer. A question without one is asked again by its id: a robot answers both alike."""
_AGAIN_S: Final = 0.1
_OBEYS: Final = "obeys session"
_UNGUIDED: Final = "is not guided"


class TakeOver:
    """Request to all robots to obey this coordinator; call `turn` in a loop.

    Robots of a coordinator that is on the bus are not taken over.

    Attributes:
        epoch: Epoch of this coordinator; 0 until all robots have said theirs.
        waits_for: Robots that have not answered, with the reasons.
    """

    def __init__(self, buses: Mapping[str, Bus], *, by_plans: bool = True) -> None:
        """Ask all robots who guides them.

        Args:
            buses: Buses of the robots, by name.
            by_plans: Whether they are guided by plans; else a robot that nobody guides has answered, too.
        """
        self._buses, self._by_plans, self.epoch = buses, by_plans, 0
        self.waits_for: dict[str, str] = {}
        self._begin(0)

    def _begin(self, epoch: int) -> None:
        self.epoch = epoch
        self.answers: dict[str, m.SetOwnerResponse] = {}
        self._open: dict[str, Question] = {}
        self._ids: dict[str, str] = {}
        self._again_s = dict.fromkeys(self._buses, 0.0)
        self.waits_for = dict.fromkeys(self._buses, "does not answer")

    def turn(self) -> bool:
        """Ask, and take answers; return True once all robots obey."""
        if not self.look():
            return False
        if self.epoch:
            return True
        if self.none_is_guided:
            return False
        self._begin(1 + max(answer.epoch for answer in self.answers.values()))
        return False

    def look(self) -> bool:
        """Ask, and take answers; return True once all have come."""
        now_s = time.monotonic()
        for name, bus in self._buses.items():
            if name in self.answers:
                continue
            if name not in self._open and now_s >= self._again_s[name]:
                asked = self._ids.setdefault(name, uuid.uuid4().hex)
                request = m.SetOwnerRequest(request_id=asked, coordinator=bus.session_id, epoch=self.epoch)
                self._open[name] = bus.ask(topics.SET_OWNER, encode(request), _ANSWER_S)
            self._take(name, now_s)
        return len(self.answers) == len(self._buses)

    def _take(self, name: str, now_s: float) -> None:
        """Take a robot's answer, if there is one."""
        question = self._open.get(name)
        answer = question.poll() if question is not None else None
        if answer is None:
            return
        del self._open[name]
        self._again_s[name] = now_s + _AGAIN_S
        if answer.refusal is not None or answer.payload is None:
            self.waits_for[name] = answer.refusal or "does not answer"
            return
        del self._ids[name]
        try:
            response = decode(m.SetOwnerResponse, answer.payload)
        except PayloadError as error:
            self.waits_for[name] = str(error)
            return
        if self.epoch == 0 and response.coordinator in self._buses[name].sessions(topics.COORDINATOR):
            self.waits_for[name] = f"{_OBEYS} {response.coordinator}, which is on the bus"
        elif (
            response.success
            or (self.epoch == 0 and response.coordinator)
            or not (self._by_plans or response.coordinator)
        ):
            self.answers[name] = response
            del self.waits_for[name]
        elif response.coordinator and response.epoch >= self.epoch > 0:
            self._begin(0)  # another one was faster
        else:
            self.waits_for[name] = response.message

    @property
    def former_is_back(self) -> bool:
        """Return whether a robot obeys another coordinator, which is on the bus, and none obeys this one yet."""
        return any(reason.startswith(_OBEYS) for reason in self.waits_for.values())

    @property
    def none_is_guided(self) -> bool:
        """Return whether all have answered, and no robot is guided by anybody."""
        answered = [each.coordinator for each in self.answers.values()]
        return not any(answered) and all(_UNGUIDED in reason for reason in self.waits_for.values())

    @property
    def followed(self) -> dict[str, FollowedPlan]:
        """State and plan of each robot, by name."""
        return {
            name: FollowedPlan(each.state, np.array(each.plan).reshape(-1, COLUMNS), each.plan_start_s)
            for name, each in self.answers.items()
        }
