"""A viewer by others: the websockets library, and no more of Foxglove's protocol than a viewer needs."""

import json
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from time import monotonic, sleep
from typing import Any

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from websockets.exceptions import InvalidMessage
from websockets.sync.client import ClientConnection, connect

_MESSAGE, _TIME, _ANSWER, _PLAYBACK = 1, 2, 3, 5
_CALL, _CONTROL = 2, 3
_TRIES = 5
_DATA = struct.Struct("<BIQ")
_ORDER = struct.Struct("<BIII")


@dataclass
class Heard:
    """One message: its topic, log time in ns, and payload."""

    topic: str
    time_ns: int
    payload: bytes


@dataclass
class Playback:
    """Position of a replay, as the server reports it."""

    playing: bool
    time_ns: int
    speed: float
    did_seek: bool


@dataclass
class ViewerClient:
    """A viewer's knowledge of a server, and the messages it has heard."""

    socket: ClientConnection
    server: dict[str, Any] = field(default_factory=dict)
    channels: dict[str, dict[str, Any]] = field(default_factory=dict)
    services: dict[str, dict[str, Any]] = field(default_factory=dict)
    parameters: dict[str, Any] = field(default_factory=dict)
    heard: list[Heard] = field(default_factory=list)
    told: list[dict[str, Any]] = field(default_factory=list)
    answers: dict[int, bytes | str] = field(default_factory=dict)
    times_ns: list[int] = field(default_factory=list)
    playback: list["Playback"] = field(default_factory=list)
    _subscribed: dict[int, str] = field(default_factory=dict)
    _calls: int = 0

    def until(self, condition: Callable[[], Any], timeout_s: float = 60.0) -> Any:
        """Listen until something has come to be."""
        deadline = monotonic() + timeout_s
        while not (value := condition()):
            assert monotonic() < deadline, f"waited in vain; told {self.told}"
            try:
                self._take(self.socket.recv(timeout=0.2))
            except TimeoutError:
                continue
        return value

    def subscribe(self, *topics: str) -> None:
        """Ask for topics, once they are advertised."""
        self.until(lambda: all(topic in self.channels for topic in topics))
        wanted = []
        for topic in topics:
            number = len(self._subscribed) + 1
            self._subscribed[number] = topic
            wanted.append({"id": number, "channelId": self.channels[topic]["id"]})
        self.say(op="subscribe", subscriptions=wanted)

    def unsubscribe(self, topic: str) -> None:
        """Let one go."""
        number = next(number for number, name in self._subscribed.items() if name == topic)
        self.say(op="unsubscribe", subscriptionIds=[number])

    def say(self, **message: Any) -> None:
        """Send JSON."""
        self.socket.send(json.dumps(message))

    def of(self, topic: str) -> list[Heard]:
        """Messages that were heard of it."""
        return [each for each in self.heard if each.topic == topic]

    def first(self, topic: str) -> Heard:
        """The first message of a topic, waited for."""
        return self.until(lambda: self.of(topic))[0]

    def decoded(self, heard: Heard) -> Any:
        """A message by the schema that the server advertises, decoded by rosbags."""
        channel = self.channels[heard.topic]
        assert (channel["encoding"], channel["schemaEncoding"]) == ("cdr", "ros2msg")
        return _decoded(channel["schema"], channel["schemaName"], heard.payload)

    def call(self, service: str, **values: Any) -> Any:
        """The response to a request, by the advertised schemas; a text if the server says that it failed."""
        self.until(lambda: service in self.services)
        asked = self.services[service]["request"]
        answer = self.call_bytes(service, _encoded(asked["schema"], asked["schemaName"], values))
        if isinstance(answer, str):
            return answer
        response = self.services[service]["response"]
        return _decoded(response["schema"], response["schemaName"], answer)

    def call_bytes(self, service: str, payload: bytes) -> bytes | str:
        """As `call`, with bytes of the request and the response."""
        number = self.ask(service, payload)
        answer: bytes | str = self.until(lambda: self.answers.get(number))
        return answer

    def ask(self, service: str, payload: bytes) -> int:
        """Send a request; returns its number among the answers."""
        self.until(lambda: service in self.services)
        self._calls += 1
        self.socket.send(_ORDER.pack(_CALL, self.services[service]["id"], self._calls, 3) + b"cdr" + payload)
        return self._calls

    def control(self, *, play: bool, speed: float = 1.0, seek_ns: int | None = None) -> None:
        """Ask for playback."""
        head = struct.pack("<BBfBQI", _CONTROL, 0 if play else 1, speed, seek_ns is not None, seek_ns or 0, 1)
        self.socket.send(head + b"r")

    def _take(self, data: str | bytes) -> None:
        if isinstance(data, str):
            self._take_text(json.loads(data))
        elif data[0] == _MESSAGE:
            _, number, time_ns = _DATA.unpack_from(data)
            self.heard.append(Heard(self._subscribed[number], time_ns, data[_DATA.size :]))
        elif data[0] == _TIME:
            self.times_ns.append(struct.unpack_from("<Q", data, 1)[0])
        elif data[0] == _ANSWER:
            _, _, number, length = _ORDER.unpack_from(data)
            self.answers[number] = data[_ORDER.size + length :]
        elif data[0] == _PLAYBACK:
            status, time_ns, speed, did_seek = struct.unpack_from("<BQfB", data, 1)
            self.playback.append(Playback(status == 0, time_ns, speed, bool(did_seek)))

    def _take_text(self, message: dict[str, Any]) -> None:
        match message["op"]:
            case "serverInfo":
                self.server = message
            case "advertise":
                self.channels |= {each["topic"]: each for each in message["channels"]}
            case "advertiseServices":
                self.services |= {each["name"]: each for each in message["services"]}
            case "parameterValues":
                self.parameters |= {each["name"]: each.get("value") for each in message["parameters"]}
            case "serviceCallFailure":
                self.answers[message["callId"]] = message["message"]
            case _:
                self.told.append(message)


@contextmanager
def viewer(url: str) -> Iterator[ViewerClient]:
    """A client that is connected and has been told what the server can do."""
    told = {"subprotocols": ["foxglove.sdk.v1"], "max_size": None, "ping_interval": None, "close_timeout": 0.1}
    with _connected(url, told) as socket:
        assert socket.subprotocol == "foxglove.sdk.v1"
        client = ViewerClient(socket)
        client.until(lambda: client.server)
        yield client


def _connected(url: str, told: dict[str, Any]) -> ClientConnection:
    """As viewers do: the server of a busy machine closes connections that it has not looked at in time."""
    for _ in range(_TRIES - 1):
        try:
            return connect(url, **told)
        except InvalidMessage:
            sleep(0.5)
    return connect(url, **told)


def _typed(schema: str, name: str) -> tuple[Any, str]:
    """A store of the types in a schema, and the name by which it has the first of them: it knows messages alone."""
    store = get_typestore(Stores.EMPTY)
    of_message = name.replace("/srv/", "/msg/")
    store.register(get_types_from_msg(schema, of_message))
    return store, of_message


def _decoded(schema: str, name: str, payload: bytes) -> Any:
    store, known = _typed(schema, name)
    return store.deserialize_cdr(payload, known)


def _encoded(schema: str, name: str, values: dict[str, Any]) -> bytes:
    store, known = _typed(schema, name)
    return bytes(store.serialize_cdr(store.types[known](**values), known))
