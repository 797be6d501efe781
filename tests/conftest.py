"""Fixtures and settings of all tests."""

import gc
import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from touchline.bus import BusConfig
from touchline.bus.ports import free_port
from touchline.schemas.plugins import VERBOSE
from touchline.supervision.priority import USUAL, run_at

# The machine is shared: how long an example takes, or the making of it, says nothing. Examples are the same every time,
# so that a test fails for what has been changed; to look for others, use --hypothesis-profile=search.
settings.register_profile("search", deadline=None, derandomize=False, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("same", settings.get_profile("search"), derandomize=True, max_examples=30)
settings.load_profile("same")

# Every module of the house is loaded here, and looking through all that for garbage time and again took a fifth of the
# processor time of these tests.
_OBJECTS_BETWEEN_COLLECTIONS = 200_000
gc.set_threshold(_OBJECTS_BETWEEN_COLLECTIONS, 20, 50)


def pytest_collection_finish() -> None:
    """Exempt all that is loaded by then from garbage collection: it stays to the end."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="module", autouse=True)
def frozen() -> None:
    """So is what has been loaded since: a robot looks through everything each time it has nothing to do."""
    gc.collect(1)
    gc.freeze()


# What processes and screens take is time on the wall, which tests that only reckon beside them can spare.
_RECKONING = {
    "checking",
    "core",
    "drawings",
    "fleet",
    "onboard",
    "planner",
    "plugins",
    "robot_sim",
    "schemas",
    "sharing",
    "study",
    "team",
}
_LATER = 15
_HERE = Path(__file__).parent


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Let the processes of other tests go before one that only reckons; only root may come back from that."""
    if os.geteuid() == 0:
        run_at(_LATER if item.path.relative_to(_HERE).parts[0] in _RECKONING else USUAL)


# Started in the background by a shell, Python ignores Ctrl-C, and under nohup a hang-up, and hands that on to its
# children; tests send both to them.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


@pytest.fixture(autouse=True)
def no_tracebacks() -> Iterator[None]:
    """A test that gives the command `-v` in this process leaves nothing of it to the next one."""
    yield
    os.environ.pop(VERBOSE, None)


@pytest.fixture(scope="module", autouse=True)
def own_state(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Robots of a module's tests keep their journal here: not in the user's folder, nor where others of their names do.

    A robot that another test has stopped in an emergency and killed would still be stopped when it is started here.
    """
    os.environ["XDG_STATE_HOME"] = str(tmp_path_factory.mktemp("state"))


@pytest.fixture
def bus_config() -> BusConfig:
    """A bus of this test's own."""
    return BusConfig(endpoint=f"tcp/127.0.0.1:{free_port()}")
