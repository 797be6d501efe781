"""Environment variables that configure the bus (`touchline.bus.config`)."""

import os
from typing import Final

ENDPOINT_VARIABLE: Final = "TOUCHLINE_ENDPOINT"
NAMESPACE_VARIABLE: Final = "TOUCHLINE_NAMESPACE"
CONFIG_VARIABLE: Final = "TOUCHLINE_ZENOH_CONFIG"
IDENTITY_VARIABLE: Final = "TOUCHLINE_IDENTITY"
OPEN_VARIABLE: Final = "TOUCHLINE_OPEN_TO_NETWORK"


def is_open_to_network() -> bool:
    """Return whether the user has allowed open endpoints that other machines reach."""
    return os.environ.get(OPEN_VARIABLE) in ("1", "true")
