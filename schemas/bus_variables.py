"""Environment variables that configure the bus (`touchline.bus.config`)."""

from typing import Final

ENDPOINT_VARIABLE: Final = "TOUCHLINE_ENDPOINT"
NAMESPACE_VARIABLE: Final = "TOUCHLINE_NAMESPACE"
CONFIG_VARIABLE: Final = "TOUCHLINE_ZENOH_CONFIG"
