"""Trigger of the bumper input of emulated robots in contact, at the lockstep exchange at which that is known."""

from __future__ import annotations

import logging
import uuid
from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

from touchline.coordination.body_contacts import PRESSED
from touchline.coordination.free_area import FreeArea
from touchline.coordination.reported_contacts import ReportedContacts
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.services.coordinator.group_call import GroupCall, reasons
from touchline.services.coordinator.robot_link import RobotLink

if TYPE_CHECKING:
    from touchline.bus import Bus

_LOG: Final = logging.getLogger(__name__)
_ANSWER_S: Final = 1.0
"""Wall-clock time for robots to take the fault; they hold their sim time meanwhile, so that all do at the same tick."""


class ContactInjector:
    """Finds contacts and injects them as bumper faults.

    Args:
        buses: Buses of the robots, by name.
        body_radius_m: Radius of each body.
        area: Area with walls.
    """

    def __init__(self, buses: Mapping[str, Bus], body_radius_m: float, area: FreeArea) -> None:
        self._buses = dict(buses)
        self._contacts = ReportedContacts(buses, body_radius_m, area)

    def press(self, tick: int, links: Mapping[str, RobotLink]) -> None:
        """Inject contacts up to a tick, before any robot drives on.

        Args:
            tick: Tick of the exchange.
            links: Links to the robots that are in the team.
        """
        for name in self._buses:
            path = links[name].path if name in links else None
            if path is None:
                self._contacts.leave(name)
            else:
                self._contacts.take(name, path)
        touched = {name: self._buses[name] for name in self._contacts.look(tick)}
        if not touched:
            return
        request = m.InjectFaultRequest(request_id=uuid.uuid4().hex, fault_json=PRESSED.model_dump_json())
        if refused := GroupCall(touched, topics.INJECT_FAULT, request, _ANSWER_S).wait():
            _LOG.warning("bumpers not triggered though robots touch: %s", reasons(refused))
