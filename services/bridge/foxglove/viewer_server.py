"""WebSocket server: channels, services, parameters and playback by Foxglove's SDK, the only place that imports it.

The SDK calls back from its own threads. Clients' requests are noted there and handled in the bridge's loop; only orders
to the robot and parameters are answered in those threads.
"""

from __future__ import annotations

import logging
import secrets
import socket
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import foxglove
from foxglove.websocket import (
    Capability,
    ChannelView,
    Client,
    PlaybackControlRequest,
    PlaybackState,
    ServerListener,
    WebSocketServer,
)

from touchline.recordings.channels import channel_metadata, kind_of
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages.base import Message
from touchline.schemas.topics import Service, Topic
from touchline.services.bridge.foxglove.viewer_access import ViewerAccess
from touchline.services.bridge.foxglove.viewer_address import FoxgloveConfig
from touchline.services.bridge.foxglove.viewer_guard import ViewerGuard

_LOG: Final = logging.getLogger(__name__)
_NAME: Final = "Touchline"
_ENCODING: Final = "cdr"
#: Messages that wait for one client; the oldest gives way. It costs only memory: nobody waits for a client.
_BACKLOG: Final = 4096

Parameters = Mapping[str, Any]
"""Values by name."""
Span = tuple[int, int]
"""From and to, ns of a recording's own clock."""


@dataclass(frozen=True)
class ServedOrder:
    """Service that viewers call.

    Attributes:
        name: With the robot's namespace.
        service: Its types.
        answer: CDR of the response to CDR of a request; called in a thread of the SDK. What it raises is sent to the
            client.
    """

    name: str
    service: Service[Any, Any]
    answer: Callable[[bytes], bytes]


@dataclass(frozen=True)
class ViewerAnswers:
    """Handlers of viewers' requests beside topics; called in threads of the SDK.

    Attributes:
        orders: Services.
        parameters: All parameters of all robots.
        control: Handler of a request to play, pause or seek; its result is None if the state is unknown.
    """

    orders: Sequence[ServedOrder]
    parameters: Callable[[], Parameters]
    control: Callable[[PlaybackControlRequest], PlaybackState | None]


class ViewerServer:
    """Serves viewers until `stop`.

    Args:
        config: Address and permissions.
        access: Requirements for viewers.
        answers: Handlers of requests.

    Raises:
        TouchlineError: The address cannot be listened on.
    """

    def __init__(self, config: FoxgloveConfig, access: ViewerAccess, answers: ViewerAnswers) -> None:
        self._config, self._access = config, access
        self._answers = answers
        self._context = foxglove.Context()
        self._subscribed: deque[int] = deque()
        self._span_ns: Span | None = None
        self._server: WebSocketServer | None = None
        try:
            self._guard = ViewerGuard((config.host, config.port), config.origins, access, _LOG.warning)
        except OSError as error:
            raise TouchlineError(
                f"--foxglove-listen {config.host}:{config.port}: cannot listen there ({error.strerror}); name another "
                "address, or stop what listens there"
            ) from error
        self._start()

    @property
    def url(self) -> str:
        """URL at which viewers connect."""
        return self._access.url(self._config.address.rpartition(":")[0], self._guard.port)

    def channel(self, name: str, topic: Topic) -> foxglove.Channel:
        """Return a channel of that name for the topic's messages as they are."""
        return foxglove.Channel(
            name,
            schema=_schema(topic.type),
            message_encoding=_ENCODING,
            context=self._context,
            metadata=channel_metadata(topic),
        )

    def take_subscribed(self) -> set[int]:
        """Return the ids of the channels with new subscribers since the last call."""
        found = set()
        while self._subscribed:
            found.add(self._subscribed.popleft())
        return found

    def send_time(self, time_ns: int) -> None:
        """Send the time that viewers show."""
        if self._server is not None:
            self._server.broadcast_time(time_ns)

    def send_playback(self, state: PlaybackState) -> None:
        """Send the state of a replay."""
        if self._server is not None:
            self._server.broadcast_playback_state(state)

    def warn(self, text: str) -> None:
        """Have viewers show a warning."""
        if self._server is not None:
            self._server.publish_status(text, foxglove.StatusLevel.Warning)

    def restart(self, span_ns: Span | None) -> None:
        """Restart the server, since clients learn only at the beginning whether and what can be played; they reconnect.

        Args:
            span_ns: Span of the replay; None if nothing is replayed.
        """
        self._stop()
        self._span_ns = span_ns
        self._start()

    def stop(self) -> None:
        """Disconnect all clients and stop."""
        self._stop()
        self._guard.stop()

    def _stop(self) -> None:
        self._guard.inner = None
        if self._server is not None:
            self._server.stop()
            self._server = None

    def _start(self) -> None:
        playback = [Capability.PlaybackControl] if self._span_ns is not None else []
        host = _hidden_host()
        self._server = foxglove.start_server(
            name=_NAME,
            host=host,
            port=0,
            capabilities=[Capability.Services, Capability.Parameters, Capability.Time, *playback],
            server_listener=_Listener(self._subscribed, self._answers, self.warn),
            supported_encodings=[_ENCODING],
            services=[_service(order) for order in self._answers.orders],
            context=self._context,
            playback_time_range=self._span_ns,
            message_backlog_size=_BACKLOG,
        )
        self._guard.inner = host, self._server.port


def _hidden_host() -> str:
    """Return an address that no web page finds: any of Linux's 16 million loopback ones, else the usual."""
    host = ".".join(map(str, (127, *(secrets.randbelow(254) + 1 for _ in range(3)))))
    try:
        with socket.create_server((host, 0)):
            return host
    except OSError:
        return "127.0.0.1"


def _service(order: ServedOrder) -> foxglove.Service:
    request, response = (
        foxglove.MessageSchema(encoding=_ENCODING, schema=_schema(kind))
        for kind in (order.service.request, order.service.response)
    )
    schema = foxglove.ServiceSchema(order.service.ros_type, request=request, response=response)
    return foxglove.Service(order.name, schema=schema, handler=lambda asked: order.answer(asked.payload))


def _schema(message: type[Message]) -> foxglove.Schema:
    kind = kind_of(message)
    return foxglove.Schema(name=kind.type, encoding=kind.schema_encoding, data=kind.schema.encode())


class _Listener(ServerListener):
    """Handler of clients' requests, called by the SDK from its threads."""

    def __init__(self, subscribed: deque[int], answers: ViewerAnswers, warn: Callable[[str], None]) -> None:
        self._subscribed = subscribed
        self._answers = answers
        self._warn = warn

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        """Note the subscription for the bridge's loop."""
        self._subscribed.append(channel.id)

    def on_get_parameters(
        self, client: Client, param_names: list[str], request_id: str | None = None
    ) -> list[foxglove.Parameter]:
        """Return the named parameters, or all."""
        known = self._answers.parameters()
        names = [name for name in param_names if name in known] if param_names else known
        return [foxglove.Parameter(name, value=known[name]) for name in names]

    def on_set_parameters(
        self, client: Client, parameters: list[foxglove.Parameter], request_id: str | None = None
    ) -> list[foxglove.Parameter]:
        """Set nothing; the client gets the values as they are."""
        names = [parameter.name for parameter in parameters]
        self._warn(f"parameters are read-only: {', '.join(names)}")
        return self.on_get_parameters(client, names) if names else []

    def on_playback_control_request(self, playback_control_request: PlaybackControlRequest) -> PlaybackState | None:
        """Pass the request on to the replay."""
        return self._answers.control(playback_control_request)
