"""Options of subcommands that take a template: its parameters, its placement, and reading them."""

from dataclasses import dataclass
from typing import Annotated, TypeVar

import typer
from pydantic import ValidationError

from touchline.schemas.catalogue import load_template, placed
from touchline.schemas.errors import SpecError
from touchline.schemas.placement import to_map
from touchline.schemas.scenario import Origin
from touchline.schemas.spec import Spec, problems_of
from touchline.schemas.template import Placement, Template

S = TypeVar("S", bound=Spec)

TemplateArgument = Annotated[
    str,
    typer.Argument(help="A shipped template's name (see `touchline templates`) or a JSON file.", show_default=False),
]
SetOption = Annotated[
    list[str] | None, typer.Option("--set", help="Parameter of the template, such as length=100; may be repeated.")
]
PlaceOption = Annotated[
    str | None, typer.Option("--place", help="Placement in the map frame: x,y (m)[,rotation (degrees)[,mirror]].")
]
OriginOption = Annotated[
    str | None,
    typer.Option("--origin", help="Geodetic origin of the map frame: latitude, longitude[, altitude] (degrees, m)."),
]
MapOriginOption = Annotated[
    str | None,
    typer.Option(
        "--map-origin",
        help="Move the drawing from its own origin to a map frame with this one: latitude, longitude[, altitude].",
    ),
]


@dataclass(frozen=True)
class PlaceChoice:
    """Placement of a drawing in the map frame, and of the map frame on the earth."""

    place: PlaceOption = None
    origin: OriginOption = None

    def laid(self, template: Template) -> Template:
        """Return ``template`` placed by the options.

        Raises:
            SpecError: An option cannot be read or is out of range.
        """
        return laid(template, self.place, self.origin)


@dataclass(frozen=True)
class TemplateChoice:
    """Template, its parameters and its placement."""

    template: TemplateArgument
    settings: SetOption = None
    place: PlaceOption = None
    origin: OriginOption = None

    def chosen(self) -> Template:
        """Return the template with its parameters set, placed by the options.

        Raises:
            SpecError: It does not exist or is not a template, or an option cannot be read or is out of range.
        """
        return laid(load_template(self.template, parameters(self.settings)), self.place, self.origin)


def laid(
    template: Template, place: str | None = None, origin: str | None = None, map_origin: str | None = None
) -> Template:
    """Return ``template`` placed by the options."""
    if place is not None:
        template = placed(template, parse_placement(place), "--place")
    if origin is not None:
        template = template.model_copy(update={"origin": parse_origin(origin, "--origin")})
    if map_origin is not None:
        if template.origin is None:
            problem = "is given for a template without an origin"
            raise SpecError("command line", "--map-origin", problem, "give its origin with --origin")
        template = to_map(template, parse_origin(map_origin, "--map-origin"))
    return template


def parameters(settings: list[str] | None) -> dict[str, str]:
    """Convert ``["length=100"]`` to ``{"length": "100"}``."""
    values: dict[str, str] = {}
    for setting in settings or ():
        name, equals, value = setting.partition("=")
        if not (name and equals and value) or name in values:
            problem = "is given twice" if name in values else f"is {setting!r}"
            raise SpecError("command line", "--set", problem, "give name=value, each name once")
        values[name.strip()] = value.strip()
    return values


def parse_placement(text: str) -> Placement:
    """Parse ``x,y[,rotation[,mirror]]`` (m, m, degrees)."""
    parts = [part.strip() for part in text.split(",")]
    mirror = len(parts) > 2 and parts[-1] == "mirror"
    numbers = _numbers(parts[:-1] if mirror else parts)
    if numbers is None or len(numbers) not in (2, 3):
        raise SpecError("command line", "--place", f"is {text!r}", "give x,y[,rotation_deg[,mirror]]")
    x, y, turn = (*numbers, 0.0)[:3]
    return _checked(Placement, "--place", {"x_m": x, "y_m": y, "rotation_deg": turn, "mirror": mirror})


def parse_origin(text: str, option: str) -> Origin:
    """Parse ``latitude,longitude[,altitude]`` (degrees, degrees, m)."""
    numbers = _numbers(text.split(","))
    if numbers is None or len(numbers) not in (2, 3):
        raise SpecError("command line", option, f"is {text!r}", "give latitude,longitude[,altitude]")
    names = ("latitude_deg", "longitude_deg", "altitude_m")
    return _checked(Origin, option, dict(zip(names, numbers, strict=False)))


def _numbers(parts: list[str]) -> list[float] | None:
    try:
        return [float(part) for part in parts]
    except ValueError:
        return None


def _checked(kind: type[S], option: str, values: dict[str, float | bool]) -> S:
    try:
        return kind.model_validate(values)
    except ValidationError as error:
        raise problems_of(error, option, values, kind) from error
