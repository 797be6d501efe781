"""Bus configuration: endpoint, robot namespaces, and overrides from a Zenoh configuration file."""

import json
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

import zenoh
from zenoh import Config

from touchline.bus import secured_settings as secured
from touchline.bus.common_settings import (
    PATIENCE_S,
    RETRY,
    client_settings,
    common_settings,
    door_client_settings,
    router_settings,
)
from touchline.bus.remote_access import SECURED_PROTOCOLS, endpoints, split
from touchline.schemas.bus_variables import (
    CONFIG_VARIABLE,
    ENDPOINT_VARIABLE,
    IDENTITY_VARIABLE,
    NAMESPACE_VARIABLE,
)
from touchline.schemas.errors import SpecError, TouchlineError
from touchline.schemas.topics import DEFAULT_NAMESPACE, NAMESPACE_RULE, ROBOT_SIM, is_namespace
from touchline.security.access_list import ACCESS_FILE
from touchline.security.identity import Identity

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7461"


@dataclass(frozen=True)
class Door:
    """A robot's own door.

    Attributes:
        endpoint: Where it is.
        settings: Configuration of a direct session there.
        namespace: The robot; "" if all robots of the bus may be met there.
    """

    endpoint: str
    settings: Config
    namespace: str = ""


@dataclass(frozen=True)
class BusConfig:
    """Configuration of a process's connection to the bus.

    By default every process is a peer on loopback without multicast: the first one listens on ``endpoint``, the others
    connect to it and learn of each other by gossip, so the first one may die without harm.

    Attributes:
        endpoint: Zenoh locator of the meeting point, unless ``config_file`` has its own endpoints.
        namespaces: Robots that the process acts for, each the first part of every key of its robot.
        config_file: Zenoh JSON5 configuration laid over ours, key by key.
        identity: Who this process is on a secured bus, where every process is a client of its router; None on an open
            one.
    """

    endpoint: str = DEFAULT_ENDPOINT
    namespaces: tuple[str, ...] = (DEFAULT_NAMESPACE,)
    config_file: Path | None = None
    identity: Identity | None = None

    def __post_init__(self) -> None:
        """Refuse values that Zenoh could not use, and what would open a secured bus."""
        if self.identity is not None and self.config_file is not None:
            remedy = f"unset one of them; {IDENTITY_VARIABLE} brings all settings of a secured bus"
            raise SpecError(CONFIG_VARIABLE, "", f"is set beside {IDENTITY_VARIABLE}", remedy)
        if self.identity is not None and not self.endpoint.startswith(("tls/", "quic/")):
            remedy = f"unset it: the access list has {self.identity.access.router}"
            raise SpecError(ENDPOINT_VARIABLE, "", f"is {self.endpoint!r}, which is not secured", remedy)
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
        """Return the configuration in the environment: the variables of `touchline.schemas.bus_variables`.

        Args:
            robots: Namespaces in place of the comma-separated ones of the environment; without either, those that an
                identity may act for.

        Raises:
            SpecError: One of them cannot be used.
        """
        file, name = os.environ.get(CONFIG_VARIABLE), os.environ.get(IDENTITY_VARIABLE)
        identity = Identity.load(name) if name else None
        meeting = identity.access.router if identity is not None else DEFAULT_ENDPOINT
        own = identity.robots if identity is not None else ()
        return cls(
            endpoint=os.environ.get(ENDPOINT_VARIABLE) or meeting,
            namespaces=tuple(robots) or named_robots() or own or (DEFAULT_NAMESPACE,),
            config_file=Path(file) if file else None,
            identity=identity,
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

    def as_identity(self, identity: Identity | None) -> Self:
        """Return the configuration of the same bus for a process of another identity."""
        return replace(self, identity=identity)

    def environment(self) -> dict[str, str]:
        """Return the variables that hand this configuration to a child process."""
        variables = {ENDPOINT_VARIABLE: self.endpoint, NAMESPACE_VARIABLE: ",".join(self.namespaces)}
        if self.config_file:
            variables[CONFIG_VARIABLE] = str(self.config_file)
        variables[IDENTITY_VARIABLE] = str(self.identity.folder) if self.identity is not None else ""
        return variables

    def identity_problem(self) -> str:
        """Return why nobody could join with the identity's files as they are now; empty without a reason."""
        if self.identity is None:
            return ""
        if not self.identity.folder.is_dir():
            return f"{self.identity.name} is revoked, or was moved: {self.identity.folder} is gone"
        try:
            Identity.load(self.identity.folder)
        except TouchlineError as error:
            return str(error)
        return ""

    def renewals(self) -> Iterator[Self | None]:
        """Iterate over looks at certificate and access list: the configuration with changed ones, else None.

        A look raises SpecError if they have become unusable.
        """
        identity = self.identity
        assert identity is not None, "only a secured bus has them"

        def looks(seen: tuple[int, ...]) -> Iterator[Self | None]:
            while True:
                if (now := _state_of(identity)) == seen:
                    yield None
                else:
                    seen = now
                    yield self.as_identity(Identity.load(identity.folder))

        return looks(_state_of(identity))

    def zenoh(self, node: str = "", patience_s: float = PATIENCE_S) -> Config:
        """Return the Zenoh session configuration of a process of this name.

        A peer that does not take a message for `patience_s` is cut off.

        Raises:
            SpecError: The configuration file cannot be used.
        """
        if self.identity is not None:
            return secured.secured_client(self.identity, self.endpoint, patience_s, node)
        config = self._from_file()
        if json.loads(config.get_json("mode")) == "client":  # of a router, which may be on another machine
            return _laid_over(config, client_settings(self.endpoint, patience_s, node))
        self._refuse_tls_over_peers(config)
        return _laid_over(config, self._peer_settings(node, patience_s))

    def router(self) -> Config:
        """Return the configuration of a router at the meeting point; the file's mode does not matter.

        Raises:
            SpecError: The configuration file cannot be used.
        """
        if self.identity is not None:
            return secured.secured_router(self.identity, self.endpoint)
        config = _laid_over(self._from_file(), router_settings(self.endpoint))
        config.insert_json5("mode", '"router"')
        return config

    def own_door(self) -> Config:
        """Return the configuration of a robot's own door on a secured bus."""
        assert self.identity is not None, "on an open bus the door is a listener of the robot's only session"
        return secured.secured_door(self.identity, self.endpoint)

    def doors(self) -> tuple[Door, ...]:
        """Return the robots' own doors, where nobody else can delay an order.

        A door is UDP, of which all sessions share one descriptor: the robot has room for it however many peers there
        are. On an open bus all robots of this machine share one; none where the configuration file leads elsewhere
        than to our endpoints.

        Raises:
            SpecError: The configuration file cannot be used.
        """
        if self.identity is not None:
            doors = secured.doors(self.identity, self.endpoint).items()
            return tuple(Door(door, secured.secured_at_door(self.identity, door), name) for name, door in doors)
        settings, door = self.zenoh(), _door(self.endpoint)
        if door is None or json.loads(settings.get_json("mode")) != "peer":
            return ()
        if self.endpoint not in endpoints(settings, "connect"):
            return ()
        for key, value in door_client_settings(door).items():
            settings.insert_json5(key, json.dumps(value))
        return (Door(door, settings),)

    def _refuse_tls_over_peers(self, config: Config) -> None:
        """Refuse TLS where every process also listens without it, which would look secured and be open.

        Raises:
            SpecError: An endpoint or the file's settings ask for TLS.
        """
        everywhere = (self.endpoint, *endpoints(config, "listen"), *endpoints(config, "connect"))
        tls = any(split(locator)[0] in SECURED_PROTOCOLS for locator in everywhere)
        if tls or json.loads(config.get_json("transport/link/tls/enable_mtls")):
            source = CONFIG_VARIABLE if self.config_file is not None else ENDPOINT_VARIABLE
            problem = "lays TLS over an open bus, whose processes all listen without it, too"
            remedy = "use `touchline up --secure` and --identity (docs/guides/security.md)"
            raise SpecError(source, "", problem, remedy)

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

    def _peer_settings(self, node: str, patience_s: float) -> dict[str, Any]:
        own = [beside(self.endpoint)] if node == ROBOT_SIM else []
        last = [door] if node == ROBOT_SIM and (door := _door(self.endpoint)) else []
        return {
            **common_settings(patience_s),
            "mode": "peer",
            # Opening waits this long for peers to show up; on loopback they do within milliseconds.
            "scouting/delay": 100,
            "listen/endpoints": [self.endpoint, *own, "tcp/127.0.0.1:0", *last],
            # Only one peer can have the meeting point; the others go on trying, so that one takes over if it dies.
            "listen/exit_on_failure": False,
            "listen/timeout_ms": 0,
            "listen/retry": RETRY,
            # Whoever keeps the meeting point may hang: the robot is met at its own door, too.
            "connect/endpoints": [self.endpoint, beside(self.endpoint)],
            "connect/exit_on_failure": False,
            "connect/timeout_ms": -1,
            "connect/retry": RETRY,
        }


def _state_of(identity: Identity) -> tuple[int, ...]:
    """Return what changes with the files of an identity: their times, 0 for what is just being replaced."""
    files = (identity.certificate, identity.key, identity.folder / ACCESS_FILE)
    return tuple(file.stat().st_mtime_ns if file.exists() else 0 for file in files)


def _laid_over(config: Config, wanted: dict[str, Any]) -> Config:
    """Return our settings with those of a file laid over them: what differs from Zenoh's defaults."""
    default = zenoh.Config()
    for key, value in wanted.items():
        if json.loads(config.get_json(key)) == json.loads(default.get_json(key)):
            config.insert_json5(key, json.dumps(value))
    return config


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
