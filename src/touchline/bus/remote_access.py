"""Detection of buses that can be reached from other machines, which are refused unless they are asked for."""

import json
import logging
from typing import Any, Final

import zenoh

from touchline.schemas.bus_variables import is_open_to_network
from touchline.schemas.errors import TouchlineError
from touchline.schemas.loopback import is_loopback_host

_LOG: Final = logging.getLogger(__name__)
SECURED_PROTOCOLS: Final = frozenset(("tls", "quic"))
"""Links with TLS."""
#: Links that never leave the machine.
_LOCAL_PROTOCOLS: Final = frozenset(("unixsock-stream", "unixpipe", "vsock"))


def check_exposure(config: zenoh.Config) -> None:
    """Refuse an open bus that other machines can reach, unless the environment allows it; then warn.

    Raises:
        TouchlineError: They can, and nobody has allowed it.
    """
    paths = beyond_loopback(config)
    if not paths:
        return
    exposed = f"this bus can be reached from other machines: {'; '.join(paths)}"
    if not is_open_to_network():
        remedy = "secure it (docs/guides/security.md), or allow it with --open-to-network"
        raise TouchlineError(f"{exposed}. Anybody there could drive the robots: {remedy}")
    _LOG.warning("%s. Anybody there can stop, start and steer the robots, and forge what they say", exposed)


def beyond_loopback(config: zenoh.Config) -> list[str]:
    """Return how a session of this configuration reaches, or is reached from, other machines; empty if it does not."""
    paths = [
        f"it {verb} {locator}"
        for side, verb in (("listen", "listens on"), ("connect", "connects to"))
        for locator in endpoints(config, side)
        if not is_loopback(locator) and not _has_mutual_tls(config, locator)
    ]
    if json.loads(config.get_json("scouting/multicast/enabled")) is not False:
        paths.append("multicast scouting is on")
    return paths


def endpoints(config: zenoh.Config, side: str) -> list[str]:
    """Return locators of one side, ``listen`` or ``connect``; Zenoh has one, a list, or a list for each mode."""
    mode = json.loads(config.get_json("mode")) or "peer"
    return list(_locators(json.loads(config.get_json(f"{side}/endpoints")), mode))


def is_loopback(locator: str) -> bool:
    """Return whether a locator such as ``tcp/127.0.0.1:7461`` is on this machine alone."""
    protocol, host, _ = split(locator)
    return protocol in _LOCAL_PROTOCOLS or is_loopback_host(host)


def _has_mutual_tls(config: zenoh.Config, locator: str) -> bool:
    """Return whether a file of Zenoh settings has secured a locator by hand."""
    mutual = json.loads(config.get_json("transport/link/tls/enable_mtls")) is True
    return mutual and split(locator)[0] in SECURED_PROTOCOLS


def split(locator: str) -> tuple[str, str, str]:
    """Return protocol, host and port of a locator."""
    protocol, _, address = locator.partition("/")
    host, _, port = address.partition("?")[0].partition("#")[0].rpartition(":")
    return protocol, host.strip("[]"), port


def _locators(value: Any, mode: str) -> list[str]:
    if isinstance(value, str):
        return [value]
    if isinstance(value, list):
        return [locator for entry in value for locator in _locators(entry, mode)]
    if isinstance(value, dict):
        return _locators(value.get(mode), mode)
    return []
