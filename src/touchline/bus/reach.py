"""Tells whether a bus can be reached from other machines."""

import ipaddress
import json
from typing import Any, Final

import zenoh

#: Links that never leave the machine.
_LOCAL_PROTOCOLS: Final = frozenset(("unixsock-stream", "unixpipe", "vsock"))


def beyond_loopback(config: zenoh.Config) -> list[str]:
    """How a session of this configuration can be reached from other machines, or reaches them; empty if it cannot."""
    ways = [f"it listens on {locator}" for locator in endpoints(config, "listen") if not is_loopback(locator)]
    ways += [f"it connects to {locator}" for locator in endpoints(config, "connect") if not is_loopback(locator)]
    if json.loads(config.get_json("scouting/multicast/enabled")) is not False:
        ways.append("multicast scouting is on")
    return ways


def endpoints(config: zenoh.Config, side: str) -> list[str]:
    """Locators of one side, ``listen`` or ``connect``; Zenoh has them as one, a list, or a list for each mode."""
    mode = json.loads(config.get_json("mode")) or "peer"
    return list(_locators(json.loads(config.get_json(f"{side}/endpoints")), mode))


def is_loopback(locator: str) -> bool:
    """Whether a locator such as ``tcp/127.0.0.1:7461`` is on this machine alone."""
    protocol, host, _ = split(locator)
    if protocol in _LOCAL_PROTOCOLS or host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def split(locator: str) -> tuple[str, str, str]:
    """Protocol, host and port of a locator."""
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
