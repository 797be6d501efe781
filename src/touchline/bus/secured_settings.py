"""Zenoh settings of a secured bus: mutual TLS with our own authority, clients of a router, and no other listeners.

They come whole from an identity. A file of settings is not laid over them, since any of its lines could open a door.
"""

import json
from typing import Any, Final

import zenoh

from touchline.bus.access_control import door_rules, router_rules
from touchline.bus.common_settings import (
    PATIENCE_S,
    client_settings,
    common_settings,
    door_client_settings,
    router_settings,
)
from touchline.schemas.errors import SpecError
from touchline.schemas.roles import Role
from touchline.security.access_list import address_of, door_beside
from touchline.security.identity import Identity

_TLS: Final = "transport/link/tls"


def secured_client(identity: Identity, endpoint: str, patience_s: float, node: str = "") -> zenoh.Config:
    """Return the configuration of a client of the router at an endpoint."""
    return _config(identity, client_settings(endpoint, patience_s, node))


def secured_router(identity: Identity, endpoint: str) -> zenoh.Config:
    """Return the configuration of a router, with the access control of all members.

    Raises:
        SpecError: The identity is not a router's.
    """
    if identity.role is not Role.ROUTER:
        problem = f"{identity.name} is no router's identity"
        raise SpecError(str(identity.folder), "", problem, "give --identity router.main, or that of this machine")
    return _config(identity, router_settings(endpoint) | {"access_control": router_rules(identity.access.members)})


def secured_door(identity: Identity, endpoint: str) -> zenoh.Config:
    """Return the configuration of a robot's own door on the bus of a router's endpoint."""
    settings = common_settings(PATIENCE_S) | {
        "mode": "peer",
        "listen/endpoints": [doors(identity, endpoint)[identity.namespace]],
        "listen/exit_on_failure": True,
        "access_control": door_rules(identity.namespace, identity.access.members),
    }
    return _config(identity, settings)


def secured_at_door(identity: Identity, door: str) -> zenoh.Config:
    """Return the configuration of a direct session with a robot."""
    return _config(identity, common_settings(PATIENCE_S) | door_client_settings(door))


def doors(identity: Identity, endpoint: str) -> dict[str, str]:
    """Return the doors of all robots that may join, by namespace.

    A job with a router of its own beside that of the access list has doors of its own, too, at the ports behind it.
    """
    robots = [member for member in identity.access.members if member.role is Role.ROBOT]
    if endpoint == identity.access.router:
        return {robot.namespace: robot.door for robot in robots}
    host, _ = address_of(endpoint)
    return {robot.namespace: door_beside(endpoint, host, number) for number, robot in enumerate(robots)}


def _config(identity: Identity, settings: dict[str, Any]) -> zenoh.Config:
    secured = {
        **settings,
        "scouting/gossip/enabled": False,
        f"{_TLS}/root_ca_certificate": str(identity.authority),
        f"{_TLS}/enable_mtls": True,
        f"{_TLS}/verify_name_on_connect": True,
        f"{_TLS}/close_link_on_expiration": True,
    }
    for side in ("listen", "connect"):
        secured |= {
            f"{_TLS}/{side}_certificate": str(identity.certificate),
            f"{_TLS}/{side}_private_key": str(identity.key),
        }
    config = zenoh.Config()
    for key, value in secured.items():
        config.insert_json5(key, json.dumps(value))
    return config
