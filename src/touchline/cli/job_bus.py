"""Bus of a job of several robots."""

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

from touchline.schemas.bus_variables import CONFIG_VARIABLE, ENDPOINT_VARIABLE

if TYPE_CHECKING:
    from touchline.bus import BusConfig


def job_bus(robots: Sequence[str]) -> "BusConfig":
    """Return the bus that the environment names, or else a private one, so that several jobs can run at once."""
    from touchline.bus import BusConfig
    from touchline.bus.ports import free_port

    if ENDPOINT_VARIABLE in os.environ or CONFIG_VARIABLE in os.environ:
        return BusConfig.from_environment(robots)
    return BusConfig(endpoint=f"tcp/127.0.0.1:{free_port()}").of(*robots)
