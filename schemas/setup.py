"""A robot and the world that it lives in: what the robot tells about itself on the bus."""

from touchline.schemas.scenario import Scenario
from touchline.schemas.spec import Spec
from touchline.schemas.vehicle import Vehicle


class Setup(Spec):
    """Of one process, from its start to its end."""

    vehicle: Vehicle = Vehicle()
    scenario: Scenario = Scenario()
