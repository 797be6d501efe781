"""Detection of buses that can be reached from other machines."""

import json
from typing import Any, Final

import zenoh

from touchline.schemas.loopback import is_loopback_host

#: Links that never leave the machine.
_LOCAL_PROTOCOLS: Final = frozenset(("unixsock-stream", "unixpipe", "vsock"))


def beyond_loopback(config: zenoh.Config) -> list[str]:
    """Return how a session of this configuration reaches, or is reached from, other machines; empty if it does not."""
    paths = [f"it listens on {locator}" for locator in endpoints(config, "listen") if not is_loopback(locator)]
    paths += [f"it connects to {locator}" for locator in endpoints(config, "connect") if not is_loopback(locator)]
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
