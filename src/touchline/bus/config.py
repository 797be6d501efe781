"""Bus configuration: endpoint, robot namespaces, and overrides from a Zenoh configuration file."""

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

import zenoh
from zenoh import Config

from touchline.bus.remote_access import endpoints
from touchline.schemas.bus_variables import CONFIG_VARIABLE, ENDPOINT_VARIABLE, NAMESPACE_VARIABLE
from touchline.schemas.cdr import MAX_PAYLOAD_BYTES
from touchline.schemas.errors import SpecError
from touchline.schemas.topics import DEFAULT_NAMESPACE, NAMESPACE_RULE, ROBOT_SIM, is_namespace

#: Time after which a peer that does not take a message is cut off, so that it holds up nobody else.
PATIENCE_S = 1.0
#: As much as `touchline.schemas.cdr` decodes, and room for Zenoh's headers.
MAX_MESSAGE_BYTES = MAX_PAYLOAD_BYTES + 65_536

#: Time after which a silent link between a client and its router is given up: a robot on its own must stop soon.
LEASE_MS = 2000
_LEASE = "transport/link/tx/lease"
#: Settings that a router has in common with all other processes.
_OF_ROUTERS = (
    "scouting/multicast/enabled",
    "transport/shared_memory/enabled",
    "transport/link/tx/queue/congestion_control/block/wait_before_close",
    "transport/link/rx/max_message_size",
    "transport/unicast/accept_timeout",
    "transport/unicast/accept_pending",
)

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7461"


@dataclass(frozen=True)
class BusConfig:
    """Configuration of a process's connection to the bus.

    By default every process is a peer on loopback without multicast: the first one listens on ``endpoint``, the others
    connect to it and learn of each other by gossip, so the first one may die without harm.

    Attributes:
        endpoint: Zenoh locator of the meeting point, unless ``config_file`` has its own endpoints.
        namespaces: Robots that the process acts for, each the first part of every key of its robot.
        config_file: Zenoh JSON5 configuration laid over ours, key by key (TLS, access control, routers).
    """

    endpoint: str = DEFAULT_ENDPOINT
    namespaces: tuple[str, ...] = (DEFAULT_NAMESPACE,)
    config_file: Path | None = None

    def __post_init__(self) -> None:
        """Refuse values that Zenoh could not use."""
        for namespace in self.namespaces:
            if not is_namespace(namespace):
                raise SpecError(NAMESPACE_VARIABLE, "", f"is {namespace!r}", NAMESPACE_RULE)
        if not self.namespaces or len(set(self.namespaces)) < len(self.namespaces):
            problem = f"is {','.join(self.namespaces)!r}"
            raise SpecError(NAMESPACE_VARIABLE, "", problem, "name at least one robot, and each once")
        protocol, _, address = self.endpoint.partition("/")
        if not protocol.isalnum() or not address:
            raise SpecError(ENDPOINT_VARIABLE, "", f"is {self.endpoint!r}", f"give a locator like {DEFAULT_ENDPOINT}")

    @classmethod
    def from_environment(cls, robots: Sequence[str] = ()) -> Self:
        """Return the configuration in ``TOUCHLINE_ENDPOINT``, ``TOUCHLINE_NAMESPACE`` and ``TOUCHLINE_ZENOH_CONFIG``.

        Args:
            robots: Namespaces in place of the comma-separated ones of the environment.

        Raises:
            SpecError: One of them cannot be used.
        """
        file = os.environ.get(CONFIG_VARIABLE)
        return cls(
            endpoint=os.environ.get(ENDPOINT_VARIABLE, DEFAULT_ENDPOINT),
            namespaces=tuple(robots) or named_robots() or (DEFAULT_NAMESPACE,),
            config_file=Path(file) if file else None,
        )

    @property
    def namespace(self) -> str:
        """Namespace of the single robot that the process acts for.

        Raises:
            SpecError: There are several.
        """
        if len(self.namespaces) > 1:
            problem = f"names {len(self.namespaces)} robots ({', '.join(self.namespaces)})"
            raise SpecError(NAMESPACE_VARIABLE, "", problem, "name one, or choose it with --robot")
        return self.namespaces[0]

    def of(self, *namespaces: str) -> Self:
        """Return the configuration of the same bus, for these robots."""
        return replace(self, namespaces=namespaces)

    def environment(self) -> dict[str, str]:
        """Return the variables that hand this configuration to a child process."""
        variables = {ENDPOINT_VARIABLE: self.endpoint, NAMESPACE_VARIABLE: ",".join(self.namespaces)}
        if self.config_file:
            variables[CONFIG_VARIABLE] = str(self.config_file)
        return variables

    def zenoh(self, node: str = "", patience_s: float = PATIENCE_S) -> Config:
        """Return the Zenoh session configuration of a process of this name.

        A peer that does not take a message for `patience_s` is cut off.

        Raises:
            SpecError: The configuration file cannot be used.
        """
        config, default = self._from_file(), zenoh.Config()
        wanted = self._settings(node, patience_s)
        if json.loads(config.get_json("mode")) == "client":  # of a router, which may be on another machine
            del wanted["listen/endpoints"]
            wanted |= {"connect/endpoints": [self.endpoint], _LEASE: LEASE_MS}
        for key, value in wanted.items():
            if json.loads(config.get_json(key)) == json.loads(default.get_json(key)):
                config.insert_json5(key, json.dumps(value))
        return config

    def router(self) -> Config:
        """Return the configuration of a router at the meeting point; the file's mode does not matter.

        Raises:
            SpecError: The configuration file cannot be used.
        """
        config, default = self._from_file(), zenoh.Config()
        common = self._settings("", PATIENCE_S)
        own = {"listen/endpoints": [self.endpoint], "listen/exit_on_failure": True, _LEASE: LEASE_MS}
        for key, value in ({name: common[name] for name in _OF_ROUTERS} | own).items():
            if json.loads(config.get_json(key)) == json.loads(default.get_json(key)):
                config.insert_json5(key, json.dumps(value))
        config.insert_json5("mode", '"router"')
        return config

    def at_door(self) -> Config | None:
        """Return the configuration of a direct session with the robot at its own door, which nobody else can delay.

        The door is UDP, of which all sessions share one descriptor: the robot has room for it however many peers there
        are. ``None`` where the configuration file leads elsewhere than to our endpoints.

        Raises:
            SpecError: The configuration file cannot be used.
        """
        settings, door = self.zenoh(), _door(self.endpoint)
        if door is None or json.loads(settings.get_json("mode")) != "peer":
            return None
        if self.endpoint not in endpoints(settings, "connect"):
            return None
        for key, value in {
            "mode": "client",
            "listen/endpoints": [],
            "connect/endpoints": [door],
            "connect/timeout_ms": 0,
            "connect/exit_on_failure": True,
            # The robot answers within milliseconds or hangs; then another try is better than a longer one.
            "transport/unicast/open_timeout": 300,
        }.items():
            settings.insert_json5(key, json.dumps(value))
        return settings

    def _from_file(self) -> Config:
        """Return the configuration file's settings; Zenoh's own defaults for the rest."""
        if self.config_file is None:
            return zenoh.Config()
        try:
            config: Config = zenoh.Config.from_file(str(self.config_file))
        except zenoh.ZError as error:
            reason = str(error).partition(" at /")[0]  # the rest is a place in Zenoh's own source
            raise SpecError(
                str(self.config_file), "", f"is not a Zenoh configuration ({reason})", "give a valid one"
            ) from error
        return config

    def _settings(self, node: str, patience_s: float) -> dict[str, Any]:
        own = [beside(self.endpoint)] if node == ROBOT_SIM else []
        last = [door] if node == ROBOT_SIM and (door := _door(self.endpoint)) else []
        retry = {"period_init_ms": 100, "period_max_ms": 1000, "period_increase_factor": 1.5}
        return {
            "mode": "peer",
            "scouting/multicast/enabled": False,
            # Opening waits this long for peers to show up; on loopback they do within milliseconds.
            "scouting/delay": 100,
            "listen/endpoints": [self.endpoint, *own, "tcp/127.0.0.1:0", *last],
            # Only one peer can have the meeting point; the others go on trying, so that one takes over if it dies.
            "listen/exit_on_failure": False,
            "listen/timeout_ms": 0,
            "listen/retry": retry,
            # Whoever keeps the meeting point may hang: the robot is met at its own door, too.
            "connect/endpoints": [self.endpoint, beside(self.endpoint)],
            "connect/exit_on_failure": False,
            "connect/timeout_ms": -1,
            "connect/retry": retry,
            "transport/shared_memory/enabled": False,
            "transport/link/tx/queue/congestion_control/block/wait_before_close": round(1e6 * patience_s),
            # Nothing honest is larger; more would be put together in memory before anybody could refuse it.
            "transport/link/rx/max_message_size": MAX_MESSAGE_BYTES,
            # Silent connections are soon closed, so that they do not take others' places.
            "transport/unicast/accept_timeout": 3000,
            "transport/unicast/accept_pending": 4000,
        }


def named_robots() -> tuple[str, ...]:
    """Return the namespaces in ``TOUCHLINE_NAMESPACE``, which commas separate; empty if it is not set."""
    given = os.environ.get(NAMESPACE_VARIABLE)
    return tuple(name.strip() for name in given.split(",")) if given is not None else ()


def _door(endpoint: str) -> str | None:
    """Return where the robot listens for direct sessions: UDP at the port of :func:`beside`."""
    protocol, _, address = beside(endpoint).partition("/")
    return f"udp/{address}" if protocol == "tcp" and address != endpoint.partition("/")[2] else None


def beside(endpoint: str) -> str:
    """Return the robot's own door: the next port after the meeting point's; the endpoint itself if it has no port."""
    address, _, port = endpoint.rpartition(":")
    return f"{address}:{int(port) + 1}" if port.isdigit() and 0 < int(port) < 65_535 else endpoint
