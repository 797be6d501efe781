"""A ROS 2 client by other people (zenoh-ros2-sdk), as a process of its own; imports nothing of ours.

Takes requests as lines of JSON on standard input and answers each with one line:

    {"do": "graph"}                                          nodes, topics and services that it discovers
    {"do": "listen", "topic": …, "type": …, "qos": …}        begins to listen
    {"do": "take"}                                           messages since the last take, by topic
    {"do": "publish", "topic": …, "type": …, "message": {…}} publishes a message
    {"do": "call", "service": …, "type": …, "request": {…}}  the response, or null
    {"do": "follow", "service": …, "type": …, "speed_mps": …} serves the robot as its path follower

Two things that the client cannot do are added here, each marked as such.
"""

import argparse
import json
import re
import sys
import time
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
import zenoh_ros2_sdk as sdk
from zenoh_ros2_sdk import discovery, keyexpr, message_registry, utils

_parse = utils._parse_msg_definition


def _parse_bounded(text: str) -> list[dict[str, Any]]:
    """Added: its hashes know ``T[<=N]`` of strings only, not of messages, which the robot's ``Curve`` has two of."""
    bounds = {name: int(bound) for bound, name in re.findall(r"\[<=(\d+)\]\s+(\w+)", text)}
    parsed = _parse(re.sub(r"\[<=\d+\]", "[]", text))
    for field in parsed:
        if field["name"] in bounds:
            field.update(is_bounded=True, array_size=bounds[field["name"]])
    return parsed


class Subscriber(sdk.ROS2Subscriber):
    """Added: it looks for kept messages of topics without an inner slash only."""

    def _discover_publishers(self) -> list[str]:
        tokens = discovery._query_liveliness(self.session_mgr, self.domain_id, "MP")
        return [token["session_id"] for token in tokens if token["qualified_name"] == self.topic]


class Client:
    """The client's state between two requests."""

    def __init__(self, place: dict[str, Any]) -> None:
        self.place = place
        self.subscribers: list[Subscriber] = []
        self.publishers: dict[str, sdk.ROS2Publisher] = {}
        self.callers: dict[str, sdk.ROS2ServiceClient] = {}
        self.served: list[sdk.ROS2ServiceServer] = []
        self.heard: dict[str, list[Any]] = {}
        self.manager = sdk.ZenohSession.get_instance(place["router_ip"], place["router_port"])

    def graph(self) -> dict[str, Any]:
        domain = self.place["domain_id"]
        everyone = f"{keyexpr.ADMIN_SPACE}/{domain}/*/*/*/NN/**"
        replies = self.manager.liveliness.get(everyone, timeout=1.0)
        nodes = [str(reply.ok.key_expr).split("/") for reply in replies if reply.ok is not None]
        return {
            "nodes": [utils.demangle_name(node[7]).rstrip("/") + "/" + node[8] for node in nodes],
            "topics": dict(sdk.get_topic_names_and_types(**self.place)),
            "services": dict(sdk.get_service_names_and_types(**self.place)),
        }

    def listen(self, topic: str, type: str, qos: str | None = None) -> str:
        heard = self.heard.setdefault(topic, [])
        self.subscribers.append(Subscriber(topic, type, heard.append, qos=qos, **self.place))
        return self.subscribers[-1].keyexpr

    def take(self) -> dict[str, list[Any]]:
        return {topic: [_plain(heard.pop(0)) for _ in range(len(heard))] for topic, heard in self.heard.items()}

    def publish(self, topic: str, type: str, message: dict[str, Any]) -> None:
        if topic not in self.publishers:
            self.publishers[topic] = sdk.ROS2Publisher(topic, type, **self.place)
            time.sleep(1.0)  # until it has been discovered
        made = self._message(type, message)
        self.publishers[topic].publish(**{name: getattr(made, name) for name in message})

    def call(self, service: str, type: str, request: dict[str, Any]) -> Any:
        caller = self._caller(service, type)
        made = self._message(caller.request_store_type, request)
        answer = caller.call(**{name: getattr(made, name) for name in request})
        return None if answer is None else _plain(answer)

    def follow(self, service: str, type: str, speed_mps: float) -> None:
        def step(request: Any) -> Any:
            return server.response_msg_class(step=request.step, speed_mps=speed_mps, yaw_rate_radps=-request.lateral_m)

        server = sdk.ROS2ServiceServer(service, type, step, **self.place)
        self.served.append(server)

    def _caller(self, service: str, type: str) -> sdk.ROS2ServiceClient:
        if service not in self.callers:
            self.callers[service] = sdk.ROS2ServiceClient(service, type, **self.place)
        return self.callers[service]

    def _message(self, name: str, values: dict[str, Any]) -> Any:
        """An object of the client's own class for ``name``, from plain values."""
        store = self.manager.store
        made = {}
        for field, (kind, detail) in store.fielddefs[name][1]:
            value = values[field]
            if kind.name == "NAME":
                value = self._message(detail, value)
            elif kind.name == "SEQUENCE":
                (inner, of), _ = detail
                value = [self._message(of, each) for each in value] if inner.name == "NAME" else np.array(value)
            made[field] = value
        return store.types[name](**made)


def _plain(value: Any) -> Any:
    """A message as JSON has it."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if is_dataclass(value):  # constants are capital, and the type's name is in underscores
        names = [field.name for field in fields(value) if field.name.islower() and not field.name.startswith("__")]
        return {name: _plain(getattr(value, name)) for name in names}
    return value


def main() -> None:
    """Answer until standard input ends."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--port", type=int, required=True)
    parser.add_argument("--domain", type=int, required=True)
    parser.add_argument("--definitions", required=True, help="folder of .msg and .srv files, by package")
    options = parser.parse_args()
    utils._parse_msg_definition = _parse_bounded
    message_registry.get_registry(options.definitions)
    client = Client({"router_ip": "127.0.0.1", "router_port": options.port, "domain_id": options.domain})
    for line in sys.stdin:
        request = json.loads(line)
        sys.stdout.write(json.dumps(getattr(client, request.pop("do"))(**request)) + "\n")
        sys.stdout.flush()
    client.manager.close()


if __name__ == "__main__":
    main()
