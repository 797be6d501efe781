"""Tables of the documentation, made from the models: `python -m tests.doc_tables` writes them.

A table stands between the lines `<!-- table: NAME -->` and `<!-- end -->` of a page. A field's description is the first
paragraph of its docstring.
"""

import ast
import inspect
import json
import re
import sys
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final, Literal, get_args, get_origin

import annotated_types
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from touchline.schemas import topics
from touchline.schemas.catalogue import shipped_templates
from touchline.schemas.docks import DockSpec
from touchline.schemas.faults import fault_models
from touchline.schemas.fields import FIELDS, Parameter
from touchline.schemas.fleet import FleetRobot
from touchline.schemas.onboard import Calibrated, OnboardConfig
from touchline.schemas.overhead_cameras import Hiding, OverheadCamera
from touchline.schemas.remedies import unit_of
from touchline.schemas.roles import Role
from touchline.schemas.scenario import GroundWave, Multipath, Obstruction, Pose2, Scenario, Steel
from touchline.schemas.spec import Spec
from touchline.schemas.task_requests import (
    ChargeRequest,
    DeliveryRequest,
    DispatchTask,
    GoToPlaceRequest,
    PatrolRequest,
    TaskRequest,
)
from touchline.schemas.team import TeamScenario
from touchline.schemas.template import ArcSpec, Area, LineSpec, Placement, Polygon, Template, TemplateSegment
from touchline.schemas.vehicles import Motor, Vehicle
from touchline.schemas.vehicles.no_tool import NoTool
from touchline.schemas.vehicles.rear_steered_drive import DrumMotor, RearSteeredDrive
from touchline.schemas.vehicles.roller_tool import RollerTool

DOCS: Final = Path(__file__).resolve().parents[1] / "docs"
MARKED: Final = re.compile(r"<!-- table: ([\w-]+) -->\n.*?<!-- end -->", re.DOTALL)
SIGNS: Final[Mapping[type, tuple[str, str]]] = {
    annotated_types.Ge: ("≥", "ge"),
    annotated_types.Gt: (">", "gt"),
    annotated_types.Le: ("≤", "le"),
    annotated_types.Lt: ("<", "lt"),
}
#: A default that takes more room is named in the description.
LONGEST_DEFAULT: Final = 40
#: Smaller numbers would be written with an exponent.
TINY: Final = 1e-3
LONGEST_ROW: Final = 160


def written(text: str) -> str:
    """Fill in every table of a page.

    Raises:
        KeyError: The page names a table that is not in `TABLES`.
    """
    return MARKED.sub(lambda found: f"<!-- table: {found[1]} -->\n\n{TABLES[found[1]]()}\n\n<!-- end -->", text)


def descriptions(model: type[BaseModel]) -> dict[str, str]:
    """First paragraph of each field's docstring, those of base classes included."""
    found: dict[str, str] = {}
    for owner in reversed(model.__mro__):
        if not (isinstance(owner, type) and issubclass(owner, Spec) and owner is not Spec):
            continue
        (body,) = ast.parse(textwrap.dedent(inspect.getsource(owner))).body
        assert isinstance(body, ast.ClassDef)
        for field, after in zip(body.body, body.body[1:], strict=False):
            match field, after:
                case (
                    ast.AnnAssign(target=ast.Name(id=name)),
                    ast.Expr(value=ast.Constant(value=str(docstring))),
                ):
                    found[name] = " ".join(inspect.cleandoc(docstring).split("\n\n")[0].split())
    return found


def table(heads: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Lay out a Markdown table."""
    lines = [tuple(heads), *(tuple(row) for row in rows)]
    lines.insert(1, ("---",) * len(lines[0]))
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def fields(model: type[BaseModel], *, without: Iterable[str] = ()) -> str:
    """Lay out a model's fields, those that are models left out unless they are described."""
    about = descriptions(model)
    rows = [
        (f"`{name}`", default(field), unit(name, field), allowed(field), about[name])
        for name, field in model.model_fields.items()
        if name in about and name not in without
    ]
    return table(("field", "default", "unit", "allowed", "meaning"), rows)


def groups(parts: Mapping[str, type[BaseModel]]) -> str:
    """Lay out several models, each under the name of its group and the first line of its docstring."""
    return "\n\n".join(f"{head(name, part)}\n\n{fields(part)}" for name, part in parts.items())


def head(name: str, model: type[BaseModel]) -> str:
    """Name a group and say what it is, for people."""
    about = (inspect.getdoc(model) or "").split("\n\n")[0].replace("\n", " ").replace("``", "`")
    return "\n".join(textwrap.wrap(f"**`{name}`**: {about}" if name else about, 120, break_on_hyphens=False))


def sub_models(model: type[BaseModel]) -> Iterator[tuple[str, type[BaseModel]]]:
    """Fields of a model whose defaults are models."""
    for name, field in model.model_fields.items():
        if isinstance(field.default, Spec):
            yield name, type(field.default)


def default(field: FieldInfo) -> str:
    """Write a default as in JSON."""
    if field.is_required():
        return "required"
    value = field.get_default(call_default_factory=True)
    if isinstance(value, BaseModel):
        return ""
    tiny = isinstance(value, float) and 0.0 < abs(value) < TINY
    shown = f"{value:.10f}".rstrip("0") if tiny else json.dumps(value, ensure_ascii=False)
    return shown if len(shown) <= LONGEST_DEFAULT else ""


def unit(name: str, field: FieldInfo) -> str:
    """Write the unit that a number's name ends in."""
    models = (part for part in get_args(field.annotation) if isinstance(part, type) and issubclass(part, BaseModel))
    return "" if any(models) else unit_of((name,))


def allowed(field: FieldInfo) -> str:
    """Write the bounds or the words of a field."""
    bounds = [*field.metadata, *(bound for part in get_args(field.annotation) for bound in bounds_of(part))]
    told = [
        f"{SIGNS[type(each)][0]} {getattr(each, SIGNS[type(each)][1]):.10g}" for each in bounds if type(each) in SIGNS
    ]
    words = [word for part in (field.annotation, *get_args(field.annotation)) for word in words_of(part)]
    return ", ".join(dict.fromkeys(told or words))


def bounds_of(annotation: Any) -> tuple[Any, ...]:
    """Find the bounds in one alternative of a field's type, as in `Annotated[float, Field(ge=0)] | None`."""
    found: list[Any] = []
    for each in getattr(annotation, "__metadata__", ()):
        found += getattr(each, "metadata", ())
    return tuple(found)


def words_of(annotation: Any) -> Iterator[str]:
    """Find the words of a `Literal` of several."""
    if get_origin(annotation) is Literal and len(get_args(annotation)) > 1:
        yield from (f"`{word}`" if isinstance(word, str) else str(word) for word in get_args(annotation))


def onboard() -> str:
    """Lay out the configuration of the robot's computer."""
    parts = dict(sub_models(OnboardConfig)) | {"calibrated.gyro_scale and others": Calibrated}
    return f"{fields(OnboardConfig)}\n\n{groups(parts)}"


def scenario() -> str:
    """Lay out a scenario."""
    parts = dict(sub_models(Scenario)) | {
        "start": Pose2,
        "sky[]": Obstruction,
        "steel[]": Steel,
        "multipath[]": Multipath,
        "ground.waves[]": GroundWave,
        "camera.cameras[]": OverheadCamera,
        "camera.hiding[]": Hiding,
    }
    own = fields(Scenario, without=("camera", "sky", "steel", "multipath"))
    return f"{own}\n\n{groups(parts)}"


def vehicle() -> str:
    """Lay out the line marker: body, drive and tool."""
    shipped = Vehicle()
    parts = {name: type(getattr(shipped, name)) for name in ("body", "drive")} | {"drive.motor": Motor}
    parts |= {"tool": type(shipped.tool), 'tool, of the kind "none"': NoTool}
    return f"{fields(Vehicle)}\n\n{groups(parts)}"


def roller() -> str:
    """Lay out drive and tool of the clay roller."""
    return groups({"drive": RearSteeredDrive, "drive.motor": DrumMotor, "tool": RollerTool})


def faults() -> str:
    """Lay out the kinds of faults."""
    rows = []
    for kind in fault_models().values():
        own = {
            name: field for name, field in kind.model_fields.items() if name not in ("kind", "start_s", "duration_s")
        }
        parameters = ", ".join(f"`{name}` ({default(field)})" for name, field in own.items())
        about = " ".join((inspect.getdoc(kind) or "").split("\n\n")[0].split()).replace("``", "`")
        row = f"`{get_args(kind.model_fields['kind'].annotation)[0]}`", parameters, about
        fits = len(table((), [row]).splitlines()[-1]) <= LONGEST_ROW
        rows.append(row if fits else (*row[:2], about.partition(":")[0] + "."))
    return table(("kind", "parameters (defaults)", "effect"), rows)


def template() -> str:
    """Lay out a template's file."""
    parts = {"segments[]": TemplateSegment, "segments[].line": LineSpec, "segments[].arc": ArcSpec, "areas[]": Area}
    return f"{fields(Template)}\n\n{groups(parts | {'boundary, obstacles[]': Polygon, 'placement': Placement})}"


def template_parameters() -> str:
    """Lay out the parameters of the shipped templates."""
    rows = [
        (f"`{name}`", f"`{each.name}`", shown(each), each.allowed, each.description)
        for name in shipped_templates()
        for each in FIELDS[name].parameters
    ]
    return table(("template", "parameter", "default", "allowed", "meaning"), rows)


def shown(parameter: Parameter) -> str:
    """Write a parameter's default as `--set` takes it."""
    return json.dumps(parameter.default)


def rights() -> str:
    """Lay out the topic table's roles."""
    publishing = [(f"`{topic.name}`", roles(topic.publishers), "") for topic in topics.TOPICS]
    serving = [(f"`{each.name}`", roles(each.servers), roles(each.callers)) for each in topics.ALL_SERVICES]
    return table(("topic or service", "publishes or serves", "may ask"), [*publishing, *serving])


def roles(some: frozenset[Role]) -> str:
    """Write roles in the order of their definition."""
    return "*all*" if some == topics.ANYBODY else ", ".join(role for role in Role if role in some)


def requests() -> str:
    """Lay out a file of requests: the fields of every request once, then those of each category."""
    parts: dict[str, type[BaseModel]] = {
        "file": DispatchTask,
        "every request": TaskRequest,
        "go_to_place": GoToPlaceRequest,
        "patrol": PatrolRequest,
        "delivery": DeliveryRequest,
        "charge": ChargeRequest,
        "docks": DockSpec,
    }
    common = TaskRequest.model_fields
    return "\n\n".join(
        f"{head(name, part)}\n\n{fields(part, without=() if part is TaskRequest else common)}"
        for name, part in parts.items()
    )


TABLES: Final[Mapping[str, Callable[[], str]]] = {
    "onboard": onboard,
    "scenario": scenario,
    "vehicle": vehicle,
    "roller": roller,
    "faults": faults,
    "fleet-robot": lambda: fields(FleetRobot),
    "team": lambda: fields(TeamScenario),
    "requests": requests,
    "template": template,
    "template-parameters": template_parameters,
    "rights": rights,
}


def main() -> None:
    """Write the tables into the pages, and name those that have changed."""
    for page in sorted(DOCS.rglob("*.md")):
        before = page.read_text(encoding="utf-8")
        if (after := written(before)) != before:
            page.write_text(after, encoding="utf-8")
            sys.stdout.write(f"{page.relative_to(DOCS)}\n")


if __name__ == "__main__":
    main()
