"""Presses the bumpers of emulated robots that touch each other, at the exchange in lockstep at which that is known."""

from __future__ import annotations

import sys
import uuid
from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

from touchline.fleet.body_contacts import PRESSED
from touchline.fleet.free_area import FreeArea
from touchline.fleet.told_contacts import ToldContacts
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.services.coordinator.asking import AskedRobots, reasons
from touchline.services.coordinator.robot_line import RobotLine

if TYPE_CHECKING:
    from touchline.bus import Bus

_ANSWER_S: Final = 1.0
"""Wall time that robots have to take the fault; they hold their sim time meanwhile, so that all do at the same tick."""


class BumperPresser:
    """See the module.

    Args:
        buses: Of the robots, by name.
        body_radius_m: Of each.
        area: Between whose walls they drive.
    """

    def __init__(self, buses: Mapping[str, Bus], body_radius_m: float, area: FreeArea) -> None:
        self._buses = dict(buses)
        self._told = ToldContacts(buses, body_radius_m, area)

    def press(self, tick: int, lines: Mapping[str, RobotLine]) -> None:
        """Press the bumpers of robots that have come to touch something up to a tick, before anybody drives on.

        Args:
            tick: Of the exchange.
            lines: To the robots that are in the team.
        """
        for name in self._buses:
            way = lines[name].way if name in lines else None
            if way is None:
                self._told.leave(name)
            else:
                self._told.take(name, way)
        touched = {name: self._buses[name] for name in self._told.look(tick)}
        if not touched:
            return
        request = m.InjectFaultRequest(request_id=uuid.uuid4().hex, fault_json=PRESSED.model_dump_json())
        if refused := AskedRobots(touched, topics.INJECT_FAULT, request, _ANSWER_S).wait():
            sys.stderr.write(f"warning: bumpers that are not pressed though robots touch: {reasons(refused)}\n")
