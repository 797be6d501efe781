"""Identities in whose names the bridge asks on a secured bus: for viewers, and for ROS 2 nodes."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Final

from touchline.bus import Bus, BusConfig
from touchline.schemas import topics
from touchline.schemas.errors import SpecError
from touchline.schemas.roles import Role
from touchline.security.identity import Identity

_OPTIONS: Final = {Role.VIEWER: "--viewer-identity", Role.GATEWAY: "--gateway-identity"}


def door_identity(config: BusConfig, role: Role, name: str) -> Identity | None:
    """Return the identity of those who come in by a door of the bridge; None if none is given.

    Args:
        config: Bus configuration of the bridge.
        role: Role of those who come in.
        name: Name or folder of the identity; empty if none is given.

    Raises:
        SpecError: It cannot be used, is of another role, or the bus is open.
    """
    if not name:
        return None
    option = _OPTIONS[role]
    if config.identity is None:
        remedy = "leave it out, or join a secured bus with --identity NAME"
        raise SpecError("command line", option, "is given on an open bus, which knows no identities", remedy)
    identity = Identity.load(name)
    if identity.role is not role:
        remedy = f"give one of the role {role}: touchline keys issue {role} NAME"
        raise SpecError("command line", option, f"is {identity.name}", remedy)
    return identity


@contextmanager
def buses_as(identity: Identity | None, buses: Sequence[Bus], stop: Callable[[], object]) -> Iterator[Sequence[Bus]]:
    """Yield buses of the same robots by which requests are made in the name of an identity, in a session of its own.

    Args:
        identity: The identity; None: the given buses are yielded.
        buses: The bridge's own, of each robot.
        stop: Waiting for an absent router ends when this returns true.
    """
    if identity is None:
        yield buses
        return
    config = buses[0].config.of(*(bus.namespace for bus in buses)).as_identity(identity)
    with Bus.open_all(topics.OBSERVER, config, stop) as own:
        yield own
