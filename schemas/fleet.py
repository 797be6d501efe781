"""Several robots as data: what ``--robots`` takes."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Final, Self

from pydantic import Field, field_validator, model_validator

from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import MAX_SEED, Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.spec import Spec, parse, read_text
from touchline.schemas.topics import NAMESPACE_RULE, is_namespace
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.shipped import SHIPPED

_FILES: Final[Mapping[str, type[Spec]]] = {"vehicle": Vehicle, "onboard": OnboardConfig, "scenario": Scenario}
"""Fields that may be the name of a file instead, relative to the fleet's; a vehicle also a shipped one's name."""


class FleetRobot(Spec):
    """One robot: its name on the bus, itself, its computer and its world; what is left out is as by default."""

    namespace: str
    """Letters, digits, `_` and single `/`, at most 64 characters; unique."""
    vehicle: Vehicle = Vehicle()
    """A vehicle, a shipped one's name, or a file; default: the shipped robot."""
    onboard: OnboardConfig = OnboardConfig()
    """The computer's configuration, or a file; default: the shipped robot's."""
    scenario: Scenario = Scenario()
    """The robot's world, or a file; default: the default scenario."""
    seed: Annotated[int, Field(ge=0, le=MAX_SEED)] | None = None
    """Seed in place of the scenario's; robots of the same seed have the same noise."""

    @field_validator("namespace")
    @classmethod
    def _can_be_a_key(cls, namespace: str) -> str:
        if not is_namespace(namespace):
            raise ValueError(NAMESPACE_RULE)
        return namespace

    @property
    def setup(self) -> Setup:
        """Setup that decides its sessions."""
        setup = Setup(vehicle=self.vehicle, onboard=self.onboard, scenario=self.scenario)
        return setup if self.seed is None else setup.with_seed(self.seed)


class Fleet(Spec):
    """Robots on one bus, each under a namespace of its own."""

    robots: Annotated[tuple[FleetRobot, ...], Field(min_length=1, max_length=256)]

    @model_validator(mode="after")
    def _names_are_different(self) -> Self:
        names = [robot.namespace for robot in self.robots]
        for index, name in enumerate(names):
            if name in names[:index]:
                raise ValueError(f"robots[{index}].namespace is {name!r}, as is an earlier one's: give each its own")
        return self

    @classmethod
    def read(cls, path: Path) -> Self:
        """The fleet in a file, and in the files that it names.

        Raises:
            SpecError: One of them is not what it should be; it names the file and the field.
        """
        text = read_text(path)
        given = parse(_Entries, text, path.name)
        robots: list[Any] = [_with_files(entry, path.parent) for entry in given.robots]
        return parse(cls, json.dumps({"robots": robots}), path.name)

    @classmethod
    def of(cls, setups: Mapping[str, Setup]) -> Self:
        """Of robots by their namespaces."""
        return cls(
            robots=tuple(
                FleetRobot(namespace=name, vehicle=setup.vehicle, onboard=setup.onboard, scenario=setup.scenario)
                for name, setup in setups.items()
            )
        )

    def setups(self) -> dict[str, Setup]:
        """Setup that decides each robot's sessions, by namespace."""
        return {robot.namespace: robot.setup for robot in self.robots}


class _Entries(Spec):
    """A fleet whose robots have not been looked at yet."""

    robots: tuple[Any, ...]


def _with_files(entry: Any, folder: Path) -> Any:
    """An entry with the contents of the files that it names in their place."""
    if not isinstance(entry, dict):
        return entry
    return {name: _content(name, value, folder) for name, value in entry.items()}


def _content(name: str, value: Any, folder: Path) -> Any:
    if name not in _FILES or not isinstance(value, str):
        return value
    if name == "vehicle" and value in SHIPPED:
        return SHIPPED[value].vehicle.model_dump(mode="json")
    return parse(_FILES[name], read_text(folder / value), value).model_dump(mode="json")
