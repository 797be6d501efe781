"""What every test may need."""

import signal
import socket

import pytest

from services.bus import BusConfig

# Started in the background by a shell, Python ignores Ctrl-C and hands that on to its children; tests send it to them.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def bus_config() -> BusConfig:
    """A bus of this test's own, on a port that was free a moment ago."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    return BusConfig(endpoint=f"tcp/127.0.0.1:{port}")
