"""``touchline templates``: shipped templates, text, and drawings of other programs."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Column, Table
from typer.core import TyperGroup

from touchline.cli.display import print_event, print_json, print_table, progress_bar, say
from touchline.cli.groups import with_groups
from touchline.cli.options import JsonOption, check_plot
from touchline.cli.template_choice import MapOriginOption, PlaceChoice, SetOption, TemplateChoice, laid
from touchline.recordings.writing import check_writable, write_text, writing
from touchline.schemas.errors import SpecError
from touchline.schemas.lettering import Corners, write
from touchline.schemas.messages import Event
from touchline.schemas.plain_text import plain
from touchline.schemas.template import Template

if TYPE_CHECKING:
    from touchline.drawings.importer import Imported, ImportOptions
    from touchline.drawings.omissions import Omission
    from touchline.schemas.fields import Field

OutOption = Annotated[Path | None, typer.Option("--out", help="Write the template to this JSON file.")]
LineWidthOption = Annotated[float, typer.Option(help="Width of the strokes, m.", min=0.02, max=0.3)]

_SHOW = "show"
#: Left-out elements that are named one by one.
_NAMED = 12


class _ShowByDefault(TyperGroup):
    """Group whose arguments, unless they begin with a subcommand, are those of ``show``."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        if not args or (args[0] not in self.commands and args[0] not in ("--help",)):
            args = [_SHOW, *args]
        return super().parse_args(ctx, args)


def register(app: typer.Typer) -> None:
    """Add the subcommands to `app`."""
    group = typer.Typer(cls=_ShowByDefault, rich_markup_mode=None, help=_HELP)
    group.command(_SHOW)(with_groups(show))
    group.command("text")(with_groups(text))
    group.command("import")(with_groups(import_))
    app.add_typer(group, name="templates")


_HELP = """List the shipped templates, print or draw one, write text, or import a drawing.

`touchline templates` lists them; `touchline templates soccer-11 --set length=100` prints one.
"""


@dataclass(frozen=True)
class TemplateFiles:
    """Destinations of a template; standard output if none is given."""

    out: OutOption = None
    plot: Annotated[Path | None, typer.Option(help="Draw the template to this .svg file.")] = None

    def deliver(self, template: Template) -> None:
        """Write and draw the template.

        Raises:
            SpecError: A file cannot be written, or the picture's format is not supported.
        """
        if self.plot is not None:
            from touchline.drawings.picture import picture

            if self.plot.suffix != ".svg":
                raise SpecError("command line", "--plot", f"ends in {self.plot.suffix!r}", "use .svg")
            write_text(picture(template), self.plot)
        if self.out is not None:
            write_text(template.to_json(), self.out)
        if self.out is None and self.plot is None:
            typer.echo(template.to_json().rstrip())


def show(
    name: Annotated[str | None, typer.Argument(help="Print this template (or JSON file) as JSON.")] = None,
    settings: SetOption = None,
    *,
    where: PlaceChoice,
    map_origin: MapOriginOption = None,
    files: TemplateFiles,
    as_json: JsonOption = False,
) -> None:
    """List the shipped templates, or print one as JSON to start your own from."""
    if name is not None:
        template = TemplateChoice(name, settings, where.place, where.origin).chosen()
        files.deliver(laid(template, map_origin=map_origin))
        return
    _list(
        {"--set": settings, "--place": where.place, "--origin": where.origin, "--out": files.out, "--plot": files.plot},
        as_json,
    )


def _list(given: dict[str, object], as_json: bool) -> None:
    """List the shipped templates; refuse options in ``given``, which concern a single one."""
    from touchline.schemas.fields import FIELDS  # here: every process of the system starts through this command line

    for option, value in given.items():
        if value is not None:
            raise SpecError("command line", option, "is given without a template", f"name one of: {', '.join(FIELDS)}")
    if as_json:
        print_json([_row(field) for field in FIELDS.values()])
        return
    table = Table(Column("name", no_wrap=True), "title", "strokes", "line, area", "parameters")
    for field_name, field in FIELDS.items():
        template = field.template()
        shown = ", ".join(parameter.name for parameter in field.parameters)
        extent = f"{template.area_m2:,.1f} m²" if template.areas else f"{template.length_m:.1f} m"
        table.add_row(field_name, template.title, str(len(template.segments)), extent, shown)
    print_table(table)


def text(
    words: Annotated[str, typer.Argument(help="Text: capitals, digits and a few signs.")],
    height: Annotated[float, typer.Option(help="Height of the letters, m.", min=0.1, max=100.0)] = 2.0,
    line_width: LineWidthOption = 0.12,
    corners: Annotated[Corners, typer.Option(help="Corners of the letters: square, cut, or round.")] = Corners.CUT,
    *,
    where: PlaceChoice,
    files: TemplateFiles,
) -> None:
    """Write TEXT in single strokes; (0, 0) is the lower left corner of the first letter."""
    strokes = tuple(write(words, height, line_width, corners))
    source = f"Text, {height:g} m high. Origin at the lower left corner, x along the text, y up, in m."
    template = Template(name="text", title=words, source=source, line_width_m=line_width, segments=strokes)
    files.deliver(where.laid(template))


@dataclass(frozen=True)
class ImportChoice:
    """Tolerance of an import, and its selection."""

    scale: Annotated[
        float | None, typer.Option(help="Metres per unit of the drawing (default: the drawing's own unit).")
    ] = None
    line_width: LineWidthOption = 0.12
    detail: Annotated[
        float | None,
        typer.Option(
            help="Smallest feature to keep, m (default: line width; 0: all that can be painted).", min=0.0, max=10.0
        ),
    ] = None
    fill: Annotated[bool, typer.Option("--fill", help="Fill coloured shapes and hatches with strokes.")] = False
    fill_angle: Annotated[float, typer.Option(help="Direction of filling strokes, degrees.")] = 0.0
    areas: Annotated[bool, typer.Option("--areas", help="Import closed shapes as areas with holes, not as lines.")] = (
        False
    )
    layer: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME", help="Read only this layer (DXF) or group (SVG, by label or id); may be repeated."
        ),
    ] = None
    boundary: Annotated[
        str,
        typer.Option(
            metavar="LAYER",
            help="Take the largest closed outline of this layer, otherwise unread, as the boundary.",
            show_default=False,
        ),
    ] = ""
    anchor: Annotated[str, typer.Option(help="Point that becomes (0, 0): centre, corner (lower left) or own.")] = (
        "centre"
    )

    def options(self) -> "ImportOptions":
        """Return the importer's options.

        Raises:
            SpecError: There is no such anchor.
        """
        from touchline.drawings.importer import Anchor, ImportOptions

        if self.anchor not in list(Anchor):
            raise SpecError("command line", "--anchor", f"is {self.anchor!r}", f"give {', '.join(Anchor)}")
        return ImportOptions(
            self.scale,
            self.line_width,
            self.fill,
            self.fill_angle,
            Anchor(self.anchor),
            self.detail,
            self.areas,
            tuple(self.layer or ()),
            self.boundary,
        )


def import_(
    drawing: Annotated[Path, typer.Argument(help="An .svg or .dxf file.")],
    choice: ImportChoice,
    where: PlaceChoice,
    out: OutOption = None,
    plot: Annotated[
        Path | None,
        typer.Option(help="Draw the template, the original and their largest differences to this .svg or .png file."),
    ] = None,
) -> None:
    """Import the lines and curves of an SVG or DXF drawing, as closely as the painted line can show."""
    from touchline.drawings.importer import import_drawing

    options = choice.options()
    check_plot(plot)
    check_writable(out, plot)
    with progress_bar(f"Importing {plain(drawing.name, 40)}") as advance:
        imported = import_drawing(drawing, options, advance)
        if plot is not None:
            from touchline.drawings.comparison import draw_comparison

            advance(1.0, "drawing the picture")
            with writing(plot):
                draw_comparison(imported, plot)
    _tell(drawing.name, imported)
    if out is not None or plot is None:
        TemplateFiles(out).deliver(where.laid(imported.template))


def _tell(name: str, imported: "Imported") -> None:
    """Report the result of an import on standard error."""
    template = imported.template
    made = f"{len(template.segments):,} lines and arcs of {imported.pieces:,} drawn ones, {template.length_m:.1f} m"
    say(f"{name}: {made}, within {imported.deviation_m * 1e3:.2f} mm")
    found = imported.found
    if template.areas:
        holes = sum(len(area.holes) for area in template.areas)
        say(f"{_counted(len(template.areas), 'area')} of {template.area_m2:,.2f} m² with {_counted(holes, 'hole')}")
    if found.mended:
        named = f"{', '.join(found.mended[:_NAMED])}{_more(len(found.mended))}"
        print_event(Event.INFO, f"crosses itself; the enclosed parts are the area: {named}")
    changes = [
        f"{count:,} {what if count == 1 else many}"
        for count, what, many in (
            (imported.dots, "outline is painted as a dot", "outlines are painted as dots"),
            (imported.doubled, "that goes there and back is painted once", "that go there and back are painted once"),
            (found.united, "shape overlaps another and is joined with it", "shapes overlap others and are joined"),
            (found.small, "shape or hole is too small", "shapes and holes are too small"),
            (imported.repeated, "lies on another and is left out", "lie on others and are left out"),
        )
        if count
    ]
    if changes:
        print_event(Event.INFO, f"smaller than --detail, or drawn twice: {'; '.join(changes)}")
    for reason, elements in _by_reason(imported.omissions):
        print_event(Event.WARN, f"{', '.join(elements[:_NAMED])}{_more(len(elements))} {reason}")
    if imported.skipped:
        print_event(Event.WARN, f"left out: {', '.join(imported.skipped[:_NAMED])}{_more(len(imported.skipped))}")


def _by_reason(omissions: Sequence["Omission"]) -> list[tuple[str, list[str]]]:
    """Group the elements that are not painted, or not fully, by the reason."""
    found: dict[str, list[str]] = {}
    for omission in omissions:
        found.setdefault(omission.reason, []).append(omission.element)
    return list(found.items())


def _counted(count: int, what: str) -> str:
    return f"{count:,} {what}{'' if count == 1 else 's'}"


def _row(field: "Field") -> dict[str, Any]:
    template = field.template()
    return {
        "name": field.name,
        "title": template.title,
        "segments": len(template.segments),
        "length_m": template.length_m,
        "area_m2": template.area_m2,
        "source": template.source,
        "parameters": [
            {"name": p.name, "default": p.default, "allowed": p.allowed, "description": p.description}
            for p in field.parameters
        ],
    }


def _more(count: int) -> str:
    return f" and {count - _NAMED} more" if count > _NAMED else ""
