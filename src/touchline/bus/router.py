"""Router of a bus that spans several machines: every process is its client, and it passes on their messages."""

from collections.abc import Iterator
from contextlib import contextmanager

import zenoh

from touchline.bus.config import BusConfig
from touchline.bus.remote_access import endpoints
from touchline.schemas.errors import TouchlineError


@contextmanager
def open_router(config: BusConfig) -> Iterator[str]:
    """Route at the meeting point of a bus until the context is left; yield where it listens.

    Raises:
        SpecError: The configuration cannot be used.
        TouchlineError: It cannot listen there.
    """
    zenoh.init_log_from_env_or("off")
    settings = config.router()
    where = ", ".join(endpoints(settings, "listen"))
    try:
        session = zenoh.open(settings)
    except zenoh.ZError as error:
        reason = str(error).partition(" at /")[0]  # the rest is a place in Zenoh's own source
        raise TouchlineError(f"the router cannot listen on {where}: {reason}") from error
    with session:
        yield where
