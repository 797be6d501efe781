"""Setup of one robot: vehicle, computer and scenario. It determines a session, and the robot publishes it."""

from typing import Any, Self

from pydantic import model_validator

from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import MAX_SEED, OF_THE_COMPUTER, Origin, Scenario
from touchline.schemas.spec import Spec
from touchline.schemas.vehicles import Vehicle


class Setup(Spec):
    """Of one process, from its start to its end."""

    vehicle: Vehicle = Vehicle()
    onboard: OnboardConfig = OnboardConfig()
    scenario: Scenario = Scenario()

    @model_validator(mode="before")
    @classmethod
    def _of_older_recordings(cls, given: Any) -> Any:
        """Recordings from before there was an `onboard` have its fields in the scenario."""
        scenario = given.get("scenario") if isinstance(given, dict) and "onboard" not in given else None
        if not isinstance(scenario, dict):
            return given
        moved = {name: value for name, value in scenario.items() if name in OF_THE_COMPUTER}
        left = {name: value for name, value in scenario.items() if name not in OF_THE_COMPUTER}
        return {**given, "onboard": moved, "scenario": left}

    def at(self, origin: Origin | None) -> Self:
        """This setup with the map frame's origin at ``origin``; unchanged if that is None."""
        return self.model_copy(update={"scenario": self.scenario.at(origin)})

    def with_seed(self, seed: int) -> Self:
        """This setup with another seed; beyond the largest one it wraps to 0."""
        scenario = self.scenario.model_copy(update={"seed": seed % (MAX_SEED + 1)})
        return self.model_copy(update={"scenario": scenario})
