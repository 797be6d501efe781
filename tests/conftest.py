"""What every test may need."""

import signal

import pytest
from hypothesis import HealthCheck, settings

from services.bus import BusConfig
from tests.meeting import free_port

# The machine is shared: how long an example takes, or the making of it, says nothing.
settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")

# Started in the background by a shell, Python ignores Ctrl-C and hands that on to its children; tests send it to them.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def bus_config() -> BusConfig:
    """A bus of this test's own."""
    return BusConfig(endpoint=f"tcp/127.0.0.1:{free_port()}")
