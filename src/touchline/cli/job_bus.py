"""Bus of a job of several robots."""

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

from touchline.schemas.bus_variables import CONFIG_VARIABLE, ENDPOINT_VARIABLE, IDENTITY_VARIABLE
from touchline.schemas.errors import SpecError

if TYPE_CHECKING:
    from touchline.bus import BusConfig


def job_bus(robots: Sequence[str], *, secure: bool) -> "BusConfig":
    """Return the bus that the environment names, or else a private one, so that several jobs can run at once.

    Args:
        robots: Namespaces of the robots.
        secure: Whether it is a secured bus.

    Raises:
        SpecError: An identity is given for an open bus.
    """
    from touchline.bus import BusConfig
    from touchline.bus.ports import free_port

    if os.environ.get(IDENTITY_VARIABLE) and not secure:
        problem = "is given, and this job starts an open system, which anybody on this machine can command"
        remedy = f"add --secure, or unset {IDENTITY_VARIABLE}"
        raise SpecError("command line", "--identity", problem, remedy)

    if ENDPOINT_VARIABLE in os.environ or CONFIG_VARIABLE in os.environ:
        return BusConfig.from_environment(robots)
    return BusConfig(endpoint=f"{'tls' if secure else 'tcp'}/127.0.0.1:{free_port()}").of(*robots)
