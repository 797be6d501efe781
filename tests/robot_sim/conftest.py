"""A robot's bus, an operator on it, and a place for its journal."""

import pytest

from touchline.bus import Bus
from touchline.schemas import topics


@pytest.fixture
def bus(bus_config):
    with Bus.open(topics.ROBOT_SIM, bus_config) as bus:
        yield bus


@pytest.fixture
def operator(bus_config, bus):
    with Bus.open(topics.OPERATOR, bus_config) as operator:
        yield operator


@pytest.fixture
def path(tmp_path):
    """Of a journal, in a folder that is not there yet."""
    return tmp_path / "deep" / "tt2.journal"
