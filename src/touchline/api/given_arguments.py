"""Arguments of the public functions: names, files and objects, resolved to what they stand for."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from touchline.schemas.catalogue import load_template as load_template_file
from touchline.schemas.catalogue import load_vehicle, parse_template, shipped_templates
from touchline.schemas.errors import SpecError
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.plugins import ASKED, FOLLOWERS
from touchline.schemas.scenario import Origin, Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.spec import problems_of
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.shipped import SHIPPED, on_its_ground, with_its_own

M = TypeVar("M", bound=BaseModel)
Progress = Callable[[float, str], None]
"""Called with the fraction done, 0 to 1, and the present step."""

GEOJSON = (".geojson",)
DRAWINGS = (".svg", ".dxf")


def no_progress(_done: float, _doing: str) -> None:
    """Report nothing."""


def load_template(
    source: str | Path | Mapping[str, Any],
    /,
    *,
    scale_m: float | None = None,
    origin: tuple[float, float] | None = None,
    **parameters: float | bool | str,
) -> Template:
    """Load a template.

    Args:
        source: Name of a shipped template (`touchline.templates()`), a file (Touchline's JSON, GeoJSON, SVG or DXF), or
            the content of a JSON file.
        scale_m: Metres per unit of an SVG or DXF drawing; None: as the drawing says.
        origin: Latitude and longitude (degrees) of the map frame's origin; None: as the file says, or for GeoJSON the
            middle of what is drawn.
        **parameters: Parameters of a shipped template, such as `length=100`.

    Raises:
        SpecError: There is no such template, or it cannot be used; names the field and the remedy.
    """
    at = None
    if origin is not None:
        at = checked(Origin, dict(zip(("latitude_deg", "longitude_deg"), origin, strict=True)), "origin")
    suffix = "" if isinstance(source, Mapping) else Path(source).suffix.lower()
    if parameters and (isinstance(source, Mapping) or suffix in (*DRAWINGS, *GEOJSON)):
        raise SpecError("load_template", next(iter(parameters)), "is a parameter of no drawing", "leave it out")
    if isinstance(source, Mapping):
        return _at(parse_template(json.dumps(source)), at)
    if suffix in DRAWINGS:
        from touchline.drawings.importer import ImportOptions, import_drawing

        return _at(import_drawing(Path(source), ImportOptions(scale_m=scale_m)).template, at)
    if scale_m is not None:
        raise SpecError(str(source), "scale_m", "is given for no drawing", "leave it out")
    if suffix in GEOJSON:
        from touchline.drawings.geojson import read_geojson

        return read_geojson(Path(source), at)
    return _at(load_template_file(source, parameters), at)


def _at(template: Template, origin: Origin | None) -> Template:
    return template if origin is None else template.model_copy(update={"origin": origin})


def templates() -> tuple[str, ...]:
    """Names of the shipped templates."""
    return shipped_templates()


def vehicles() -> tuple[str, ...]:
    """Names of the shipped vehicles; the first is the default."""
    return tuple(SHIPPED)


def followers() -> tuple[str, ...]:
    """Names of the path followers, those of installed plug-ins included."""
    return tuple(FOLLOWERS.names())


def checked(kind: type[M], values: Mapping[str, Any], source: str) -> M:
    """The model of these values.

    Args:
        kind: Class of the model.
        values: Values by field.
        source: Where they come from, for errors.

    Raises:
        SpecError: A value is not allowed, or a name is no field.
    """
    try:
        return kind.model_validate(values)
    except ValidationError as error:
        raise problems_of(error, source, values, kind) from error


def template_of(given: Template | str | Path | Mapping[str, Any]) -> Template:
    """The template itself, or the one that is named."""
    return given if isinstance(given, Template) else load_template(given)


def vehicle_of(given: Vehicle | str | Path | None) -> Vehicle:
    """The vehicle itself, the one that is named, or the default one."""
    if given is None:
        return Vehicle()
    return given if isinstance(given, Vehicle) else load_vehicle(given)


def setup_of(
    vehicle: Vehicle, scenario: Scenario | None, onboard: OnboardConfig | None, seed: int | None, follower: str | None
) -> Setup:
    """The robot and its world; what is not given is as `touchline simulate --vehicle NAME` has it.

    Args:
        vehicle: The robot.
        scenario: Its world; None: undisturbed, on the ground that the vehicle is made for.
        onboard: Its computer; None: the one that is shipped with the vehicle.
        seed: Seed of all noise; None: the scenario's.
        follower: Name of the follower; None: the computer's.

    Raises:
        SpecError: There is no such follower, or it is one that is asked over the bus.
    """
    shipped = SHIPPED.get(vehicle.name)
    name = vehicle.name if shipped is not None and shipped.vehicle == vehicle else ""
    world, computer = on_its_ground(name, scenario or Scenario()), with_its_own(name, onboard or OnboardConfig())
    if seed is not None:
        world = checked(Scenario, {**dict(world), "seed": seed}, "simulate")
    if follower is not None:
        computer = checked(OnboardConfig, {**dict(computer), "follower": follower}, "simulate")
    if computer.follower in ASKED:
        problem = f"is {computer.follower!r}, which is asked over the bus"
        raise SpecError("simulate", "follower", problem, "give a function or an object, or use `touchline run`")
    return Setup(vehicle=vehicle, onboard=computer, scenario=world)
