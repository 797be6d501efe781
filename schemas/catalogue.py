"""Loads templates and vehicles: shipped ones by name, the user's own from files."""

from collections.abc import Mapping
from pathlib import Path

from pydantic import ValidationError

from touchline.schemas.errors import SpecError
from touchline.schemas.fields import FIELDS
from touchline.schemas.placement import place
from touchline.schemas.spec import parse, read_text
from touchline.schemas.template import MAX_COORDINATE_M, Placement, Template
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.shipped import SHIPPED


def parse_template(text: str, source: str = "template", *, recorded: bool = False) -> Template:
    """Read a template from JSON and move it into the map frame by its own placement.

    Control characters in its texts are refused, unless it is ``recorded``: what has been painted can be looked at.

    Raises:
        SpecError: See :func:`touchline.schemas.spec.parse`; or the placement carries it further than a coordinate may
            be.
    """
    template = parse(Template, text, source, recorded=recorded)
    if template.placement is None:
        return template
    return placed(template.model_copy(update={"placement": None}), template.placement, source)


def placed(template: Template, placement: Placement, source: str = "placement") -> Template:
    """Move ``template`` by ``placement``.

    Raises:
        SpecError: It would end further out than a coordinate may be.
    """
    try:
        return place(template, placement)
    except ValidationError as error:
        problem = f"carries a point beyond {MAX_COORDINATE_M:g} m"
        raise SpecError(source, "placement", problem, "place it nearer to the map frame's origin") from error


def shipped_templates() -> tuple[str, ...]:
    """Names of the templates that come with Touchline, sorted."""
    return tuple(sorted(FIELDS))


def line_templates() -> tuple[str, ...]:
    """Names of those of them that are lines only, which is what a line marker paints, sorted.

    The areas of the others are fields: by the width of a nozzle they would be hundreds of swaths.
    """
    return tuple(name for name in shipped_templates() if not FIELDS[name].template().areas)


def template_text(name_or_path: str, parameters: Mapping[str, float | bool | str] | None = None) -> tuple[str, str]:
    """(JSON text, source) of a shipped template, drawn with its parameters, or of a file.

    Raises:
        SpecError: There is no such template or file, or a parameter is not the template's or out of its range.
    """
    if name_or_path in FIELDS:
        return FIELDS[name_or_path].template(parameters).to_json(), name_or_path
    path = Path(name_or_path)
    if not path.exists():
        names = ", ".join(FIELDS)
        raise SpecError(name_or_path, "", "is neither a shipped template nor a file", f"give a path or one of: {names}")
    if parameters:
        problem = f"has no parameters, so {next(iter(parameters))} cannot be set"
        raise SpecError(path.name, "", problem, "change the file, or name a shipped template")
    return read_text(path), path.name


def load_template(name_or_path: str | Path, parameters: Mapping[str, float | bool | str] | None = None) -> Template:
    """Load a shipped template, drawn with its parameters, or a file.

    Raises:
        SpecError: See :func:`template_text`; or the file is not a template.
    """
    text, source = template_text(str(name_or_path), parameters)
    return parse_template(text, source)


def load_vehicle(name_or_path: str | Path, /) -> Vehicle:
    """The vehicle of that shipped name, or of that file.

    Raises:
        SpecError: There is no such vehicle or file; or the file is not a vehicle.
    """
    if str(name_or_path) in SHIPPED:
        return SHIPPED[str(name_or_path)].vehicle
    path = Path(name_or_path)
    if not path.exists():
        remedy = f"give a path or one of: {', '.join(SHIPPED)}"
        raise SpecError(str(name_or_path), "", "is neither a shipped vehicle nor a file", remedy)
    return parse(Vehicle, read_text(path), path.name)
