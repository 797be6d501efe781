"""A robot's bus, and an operator on it."""

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
