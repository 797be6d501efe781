"""Test of a secured bus at its start: what must fail is tried, and the system does not start if it succeeds."""

import json
import time
from pathlib import Path

import zenoh

from touchline.bus.bus import Bus
from touchline.bus.calls import AccessError, CallError
from touchline.bus.common_settings import door_client_settings
from touchline.bus.config import BusConfig
from touchline.schemas import topics
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import CommandRequest
from touchline.security.identity import Identity


def check_secured(config: BusConfig, observer: Identity) -> None:
    """Try to join without TLS, without a certificate, and to stop the robots as an observer.

    Args:
        config: Bus configuration of a system that is up.
        observer: Identity of an observer.

    Raises:
        TouchlineError: Somebody without the right got in, or nobody answered the observer.
    """
    config = config.as_identity(observer)
    doors = [door.endpoint for door in config.doors() if door.namespace in config.namespaces]
    for endpoint in (config.endpoint, *doors):
        protocol, _, address = endpoint.partition("/")
        plain = "udp" if protocol == "quic" else "tcp"
        for tried, how in ((f"{plain}/{address}", "without TLS"), (endpoint, "without a certificate")):
            if can_join(tried, observer.authority):
                raise TouchlineError(f"this system is not secured: anybody can join at {tried} {how}")
    with Bus.open_all(topics.OBSERVER, config) as buses:
        for bus in buses:
            _try_to_pause(bus)


def can_join(endpoint: str, authority: Path) -> bool:
    """Return whether a session without a certificate can be opened.

    Args:
        endpoint: Where.
        authority: Certificate of the authority, by which the other side is known.
    """
    settings = zenoh.Config()
    wanted = {"scouting/multicast/enabled": False, "transport/link/tls/root_ca_certificate": str(authority)}
    for key, value in {**door_client_settings(endpoint), **wanted}.items():
        settings.insert_json5(key, json.dumps(value))
    try:
        session = zenoh.open(settings)
    except zenoh.ZError:
        return False
    session.close()  # type: ignore[no-untyped-call]
    return True


def _try_to_pause(bus: Bus) -> None:
    try:
        bus.call(topics.PAUSE, CommandRequest(request_id=f"test of access {time.time_ns()}"))
    except AccessError:
        return
    except CallError as error:
        raise TouchlineError(f"it cannot be shown that this system is secured: {error}") from error
    raise TouchlineError(f"this system is not secured: an observer can pause {bus.namespace}")
