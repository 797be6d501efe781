"""Viewers' access to all robots of a bridge, as driven by its loop."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any, Final, Self

from touchline.bus import Bus, CallError
from touchline.recordings.viewing import frame_prefix
from touchline.schemas.cdr import decode, encode
from touchline.schemas.errors import PayloadError
from touchline.schemas.topics import READ_ONLY_SERVICES, REPLAY_SERVICES, SERVICES, Service
from touchline.services.bridge.door_identity import buses_as
from touchline.services.bridge.foxglove.replay_playback import ReplayPlayback
from touchline.services.bridge.foxglove.viewer_access import ViewerAccess
from touchline.services.bridge.foxglove.viewer_address import FoxgloveConfig
from touchline.services.bridge.foxglove.viewer_channels import ViewerChannels
from touchline.services.bridge.foxglove.viewer_server import (
    Parameters,
    ServedOrder,
    ViewerAnswers,
    ViewerServer,
)
from touchline.services.bridge.robot_parameters import RobotParameters, plain_value
from touchline.services.bridge.routes import refusal_response

_NODE: Final = "touchline"
#: Longest time for a service to answer; planning takes longest.
_ANSWER_S: Final = 120.0
_TIME_EVERY_S: Final = 1 / 30
_PLAYBACK_EVERY_S: Final = 0.05


class Viewers:
    """Serves robots to viewers; call `turn` often.

    Args:
        buses: Bus of each robot.
        asking: Bus of each robot by which viewers ask.
        config: Address and permissions.
        access: Requirements for viewers.

    Raises:
        TouchlineError: The address cannot be served.
    """

    def __init__(
        self, buses: Sequence[Bus], asking: Sequence[Bus], config: FoxgloveConfig, access: ViewerAccess
    ) -> None:
        self._parameters = {bus.namespace: RobotParameters(bus.counters.reject) for bus in buses}
        self._leaving, self._orders_allowed = False, config.orders
        self._access = access
        self._playback = ReplayPlayback(buses, asking, self._check_staying)
        self._orders = 0
        services = (*SERVICES, *REPLAY_SERVICES) if config.orders else READ_ONLY_SERVICES
        identity = access.identity
        allowed = [each for each in services if identity is None or identity.role in each.callers]
        served = [self._served(bus, service) for bus in asking for service in allowed]
        self._server = ViewerServer(config, access, ViewerAnswers(served, self._all_parameters, self._playback.control))
        names = [bus.namespace for bus in buses]
        self._robots = {
            bus.namespace: ViewerChannels(
                bus, self._server, frame_prefix(bus.namespace, names), clock=config.clock and bus is buses[0]
            )
            for bus in buses
        }
        self._span_ns: tuple[int, int] | None = None
        self._time_ns = -1
        self._time_s = self._playback_s = 0.0

    @classmethod
    @contextmanager
    def open(
        cls, buses: Sequence[Bus], config: FoxgloveConfig, access: ViewerAccess, stop: Callable[[], object]
    ) -> Iterator[Self]:
        """Serve viewers until the context is left; see `serve_viewers`."""
        with buses_as(access.identity, buses, stop) as asking:
            viewers = cls(buses, asking, config, access)
            try:
                yield viewers
            finally:
                viewers._leaving = True
                viewers._server.stop()

    @property
    def url(self) -> str:
        """URL at which viewers connect."""
        return self._server.url

    @property
    def url_hint(self) -> str:
        """URL for the user, and what viewers need beside it."""
        return f"{self._server.url}{self._access.hint()}"

    def turn(self) -> bool:
        """Pass on what has arrived; return whether anything had."""
        subscribed, busy = self._server.take_subscribed(), False
        for name, robot in self._robots.items():
            busy |= robot.turn(subscribed)
            if robot.setup is not None:
                self._parameters[name].take_setup(robot.setup)
                robot.setup = None
        self._send_time()
        self._send_playback()
        return busy

    def figures(self, namespace: str) -> dict[str, object]:
        """Return counters of one robot for the diagnostics."""
        robot = self._robots[namespace]
        return {
            "foxglove": self._server.url,
            "foxglove_topics": robot.taken,
            "foxglove_messages": robot.messages,
            "foxglove_calls": self._orders,
        }

    def _send_time(self) -> None:
        watched = [robot.now_ns for robot in self._robots.values() if robot.watched]
        now_s = time.monotonic()
        if watched and now_s >= self._time_s and max(watched) != self._time_ns:
            self._time_ns, self._time_s = max(watched), now_s + _TIME_EVERY_S
            self._server.send_time(self._time_ns)

    def _send_playback(self) -> None:
        now_s = time.monotonic()
        if now_s < self._playback_s:
            return
        self._playback_s = now_s + _PLAYBACK_EVERY_S
        self._playback.turn()
        span_ns = self._playback.span_ns if self._orders_allowed else None
        if span_ns != self._span_ns:
            self._span_ns = span_ns
            self._server.restart(span_ns)
        if span_ns is not None and (state := self._playback.news()) is not None:
            self._server.send_playback(state)

    def _served(self, bus: Bus, service: Service[Any, Any]) -> ServedOrder:
        name = f"/{bus.namespace}/{service.name.replace('-', '_')}"
        return ServedOrder(name, service, partial(self._pass_order, bus, service))

    def _pass_order(self, bus: Bus, service: Service[Any, Any], payload: bytes) -> bytes:
        """Call the service; called in a thread of the SDK, so that a stop waits for nothing here."""
        self._orders += 1
        try:
            return encode(bus.call(service, decode(service.request, payload), _ANSWER_S, self._check_staying))
        except (CallError, PayloadError) as error:
            response = refusal_response(service, str(error))
            if response is None:
                raise
            return encode(response)

    def _check_staying(self) -> None:
        """Check, while waiting for an answer, that the process may go on: it cannot end before that.

        Raises:
            CallError: It is to end.
        """
        if self._leaving:
            raise CallError("the bridge is being stopped; the outcome is not known")

    def _all_parameters(self) -> Parameters:
        """Return parameters by the names that they have among ROS 2 nodes: ``/tt2/touchline.vehicle.name``."""
        return {
            f"/{namespace}/{_NODE}.{name}": plain_value(value)
            for namespace, response in self._parameters.items()
            for name, value in response.known().items()
        }
