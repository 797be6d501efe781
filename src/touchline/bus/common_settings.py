"""Zenoh settings that all processes have in common, on open and on secured buses."""

from typing import Any, Final

from touchline.schemas.cdr import MAX_PAYLOAD_BYTES
from touchline.schemas.topics import BRIDGE

#: Time after which a peer that does not take a message is cut off, so that it holds up nobody else.
PATIENCE_S: Final = 1.0
#: As much as `touchline.schemas.cdr` decodes, and room for Zenoh's headers.
MAX_MESSAGE_BYTES: Final = MAX_PAYLOAD_BYTES + 65_536
#: Time after which a silent link between a client and its router is given up: a robot on its own must stop soon.
_LEASE_MS: Final = 2000
#: The same of a recorder: if it hangs, the router must not close its link while telemetry waits there, which holds up
#: all other links until `PATIENCE_S` is over.
_RECORDER_LEASE_MS: Final = 10_000
RETRY: Final = {"period_init_ms": 100, "period_max_ms": 1000, "period_increase_factor": 1.5}
"""Pauses between two attempts to listen or connect."""


def common_settings(patience_s: float) -> dict[str, Any]:
    """Return what every session has.

    Args:
        patience_s: Time after which a peer that does not take a message is cut off.
    """
    return {
        "scouting/multicast/enabled": False,
        "transport/shared_memory/enabled": False,
        "transport/link/tx/queue/congestion_control/block/wait_before_close": round(1e6 * patience_s),
        # Nothing honest is larger; more would be put together in memory before anybody could refuse it.
        "transport/link/rx/max_message_size": MAX_MESSAGE_BYTES,
        # Silent connections are soon closed, so that they do not take others' places.
        "transport/unicast/accept_timeout": 3000,
        "transport/unicast/accept_pending": 4000,
    }


def client_settings(router: str, patience_s: float, node: str = "") -> dict[str, Any]:
    """Return the settings of a client of a router.

    Args:
        router: Endpoint of the router.
        patience_s: As for `common_settings`.
        node: Name of the client's process.
    """
    return {
        **common_settings(patience_s),
        "mode": "client",
        "connect/endpoints": [router],
        "connect/exit_on_failure": False,
        "connect/timeout_ms": -1,
        "connect/retry": RETRY,
        "transport/link/tx/lease": _RECORDER_LEASE_MS if node == BRIDGE else _LEASE_MS,
    }


def router_settings(endpoint: str) -> dict[str, Any]:
    """Return the settings of a router that listens at an endpoint."""
    return {
        **common_settings(PATIENCE_S),
        "mode": "router",
        "scouting/delay": 0,  # it looks for nobody
        "listen/endpoints": [endpoint],
        "listen/exit_on_failure": True,
        "transport/link/tx/lease": _LEASE_MS,
    }


def door_client_settings(door: str) -> dict[str, Any]:
    """Return the settings of a direct session with a robot at its own door."""
    return {
        "mode": "client",
        "listen/endpoints": [],
        "connect/endpoints": [door],
        "connect/timeout_ms": 0,
        "connect/exit_on_failure": True,
        # The robot answers within milliseconds or hangs; then another try is better than a longer one.
        "transport/unicast/open_timeout": 300,
    }
