"""Bus of a job of several robots."""

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

from touchline.schemas.bus_variables import CONFIG_VARIABLE, ENDPOINT_VARIABLE, IDENTITY_VARIABLE
from touchline.schemas.errors import SpecError

if TYPE_CHECKING:
    from touchline.bus import BusConfig


def job_bus(robots: Sequence[str]) -> "BusConfig":
    """Return the bus that the environment names, or else a private one, so that several jobs can run at once.

    Raises:
        SpecError: An identity is given: these jobs start an open system.
    """
    from touchline.bus import BusConfig
    from touchline.bus.ports import free_port

    if os.environ.get(IDENTITY_VARIABLE):
        problem = "is given, and jobs of several robots start an open system, which anybody on this machine can command"
        remedy = f"unset {IDENTITY_VARIABLE}; for a team use `touchline up --secure --robots FILE` and `coordinator`"
        raise SpecError("command line", "--identity", problem, remedy)

    if ENDPOINT_VARIABLE in os.environ or CONFIG_VARIABLE in os.environ:
        return BusConfig.from_environment(robots)
    return BusConfig(endpoint=f"tcp/127.0.0.1:{free_port()}").of(*robots)
