"""Every number of a vehicle, of the computer's configuration and of a fault is bounded on both sides."""

from collections.abc import Iterator
from pathlib import Path

import annotated_types
import pytest
from pydantic.fields import FieldInfo

from touchline.schemas.faults import fault_models
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.spec import Spec, parse, read_text
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.shipped import CLAY_ROLLER

EXAMPLES = Path(__file__).parents[2] / "examples"


def numbers(spec: Spec, group: str = "") -> Iterator[tuple[str, FieldInfo]]:
    """Numbers of a specification and of the specifications in it."""
    for name, field in type(spec).model_fields.items():
        value = getattr(spec, name)
        if isinstance(value, Spec):
            yield from numbers(value, f"{group}{name}.")
        elif field.annotation in (int, float):
            yield f"{group}{name}", field


FIELDS = dict(numbers(Vehicle())) | dict(numbers(CLAY_ROLLER, "roller.")) | dict(numbers(OnboardConfig(), "onboard."))
FIELDS |= {
    f"{kind}.{name}": field
    for kind, model in fault_models().items()
    for name, field in model.model_fields.items()
    if field.annotation is float
}


@pytest.mark.parametrize("name", FIELDS)
def test_every_number_is_bounded(name: str) -> None:
    kinds = {type(bound) for bound in FIELDS[name].metadata}
    assert kinds & {annotated_types.Ge, annotated_types.Gt}
    assert kinds & {annotated_types.Le, annotated_types.Lt}


def test_the_example_is_another_robot_that_says_so() -> None:
    example = parse(Vehicle, read_text(EXAMPLES / "small-robot.json"), "small-robot.json")
    shipped = Vehicle()
    assert example.name == "small-robot"
    assert example.drive.track_width_m < shipped.drive.track_width_m
    assert example.drive.max_speed_mps < shipped.drive.max_speed_mps
