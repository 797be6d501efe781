"""Router of a bus that spans several machines or is secured: every process is its client."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

from touchline.bus.config import BusConfig
from touchline.bus.joining import leave, listen
from touchline.bus.remote_access import check_exposure
from touchline.bus.secured_router import SecuredRouter

_RUNTIME_VARIABLE: Final = "ZENOH_RUNTIME"
_RECEIVING: Final = "(rx: (worker_threads: 16))"
"""Threads in which a router receives. A link from which it has something for a client that takes nothing holds one of
them for up to a second, and with Zenoh's two threads, stops by other links waited that long."""


@contextmanager
def open_router(config: BusConfig, *, alone: bool = False) -> Iterator[Callable[[], None]]:
    """Route at the meeting point of a bus until the context is left.

    Args:
        config: Bus configuration.
        alone: Whether this process does nothing else, so that its standard output can be taken for Zenoh's log, by
            which a secured router notes what it refuses.

    Yields:
        A function to be called now and then: a secured router takes over new certificates and access lists in it.

    Raises:
        SpecError: The configuration cannot be used.
        TouchlineError: It cannot listen there, or other machines could reach an open bus.
    """
    os.environ.setdefault(_RUNTIME_VARIABLE, _RECEIVING)
    if config.identity is not None:
        router = SecuredRouter(config, alone=alone)
        try:
            yield router.poll
        finally:
            router.close()
        return
    settings = config.router()
    check_exposure(settings)
    session = listen(settings, "the router")
    try:
        yield lambda: None
    finally:
        leave(session)
