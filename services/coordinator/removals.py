"""Removal of robots from a team on the bus, and their readmission."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Mapping
from functools import partial
from typing import Final, NamedTuple, TypeAlias

from touchline.bus import Bus, ServedCall
from touchline.coordination.coordination import Coordination
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.errors import SpecError
from touchline.services.coordinator.group_call import GroupCall

ABORT_S: Final = 1.0
"""Wall-clock time for a robot to acknowledge that it aborts."""

_Call: TypeAlias = ServedCall[m.TeamRobotRequest, m.TeamRobotResponse]


class _Removal(NamedTuple):
    """Pending removal: the robot has been asked to abort, and may not have answered yet."""

    call: _Call
    name: str
    asked: GroupCall


class Removals:
    """Server of removals and admissions; call `turn` in a loop.

    Args:
        bus: Bus of the team's namespace.
        coordination: The team's coordinator.
        joining: Whether robots are invited to join, so that one may be admitted again.
    """

    def __init__(self, bus: Bus, coordination: Coordination, *, joining: bool) -> None:
        self._coordination, self._joining = coordination, joining
        self._removals, self._admissions = bus.serve(topics.TEAM_REMOVE), bus.serve(topics.TEAM_ADMIT)
        self._removal: _Removal | None = None

    def turn(self, buses: Mapping[str, Bus]) -> str:
        """Serve waiting calls; return the robot that has just been removed, or "".

        Args:
            buses: Buses of the team's robots, by name.
        """
        if (call := self._admissions.poll()) is not None:
            _answer(call, partial(self._admit, call.request.robot))
        if self._removal is None:
            if (call := self._removals.poll()) is not None:
                _answer(call, partial(self._begin, call, buses))
            return ""
        if not self._removal.asked.done:
            return ""
        (call, name, asked), self._removal = self._removal, None
        return name if _answer(call, partial(self._remove, name, call.request.force, asked)) else ""

    def _begin(self, call: _Call, buses: Mapping[str, Bus]) -> str:
        name = call.request.robot
        self._coordination.check_removal(name, call.request.force)
        request = m.CommandRequest(request_id=uuid.uuid4().hex)
        self._removal = _Removal(call, name, GroupCall({name: buses[name]}, topics.ABORT, request, ABORT_S))
        return ""

    def _remove(self, name: str, forced: bool, asked: GroupCall) -> str:
        self._coordination.check_removal(name, forced)  # it may have been heard again since the request
        self._coordination.remove(name)
        drives = f"; it was asked to abort, but: {asked.refused[name]}" if forced and asked.refused else ""
        return f"{name} is out of the team; nobody keeps off it any more: it must have been carried away{drives}"

    def _admit(self, name: str) -> str:
        out = self._coordination.out
        if name not in out:
            problem, remedy = (
                f"{name} has not been removed",
                f"use {', '.join(sorted(out))}" if out else "nothing else",
            )
            raise SpecError("team", "robot", problem, remedy)
        if not self._joining:
            raise SpecError("team", "robot", "would join a team in lockstep", "start the team anew with it")
        self._coordination.admit(name)
        return f"{name} is invited to join when it is on the bus; others keep off it once it stands and is localized"


def _answer(call: _Call, work: Callable[[], str]) -> bool:
    """Answer a call with the result of the work unless that is empty; return False if it is refused."""
    try:
        message = work()
    except SpecError as error:
        call.reply(m.TeamRobotResponse(success=False, message=str(error)))
        return False
    if message:
        call.reply(m.TeamRobotResponse(success=True, message=message))
    return True
