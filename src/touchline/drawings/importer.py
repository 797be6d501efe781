"""Import of drawings of other programs (SVG, DXF) as templates."""

import itertools
import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from touchline.drawings.areas import fill_areas
from touchline.drawings.closed_shapes import FoundAreas, areas_of, boundary_of, is_shape
from touchline.drawings.detail import FINEST_M, Detail
from touchline.drawings.deviation import apart_m, sampled
from touchline.drawings.dxf import read_dxf
from touchline.drawings.omissions import Omission
from touchline.drawings.outline import Edge, Floats, Outline, shifted
from touchline.drawings.picture import bounds
from touchline.drawings.repeats import Repeats
from touchline.drawings.strokes import StrokeKind, Strokes
from touchline.drawings.svg import read_svg
from touchline.schemas.curves import Curve
from touchline.schemas.errors import SpecError
from touchline.schemas.placement import Transform
from touchline.schemas.plain_text import plain
from touchline.schemas.spec import MAX_SPEC_BYTES
from touchline.schemas.template import MAX_COORDINATE_M, ArcSpec, LineSpec, Template, TemplateSegment

Reader = Callable[[Path, float | None], tuple[list[Outline], list[Omission]]]
Progress = Callable[[float, str], None]
READERS: dict[str, Reader] = {".svg": read_svg, ".dxf": read_dxf}
#: Maximum number of segments of the planner.
MAX_SEGMENTS = 10_000
#: Maximum number of lines and curves of a drawing, each of which is fitted.
MAX_PIECES = 20_000
#: Number of layers that an error names.
_NAMED = 12
#: Maximum coordinate: larger than any on Earth, small enough for fitting to a micrometre.
MAX_REACH_M = 1e8
NO_AREAS = FoundAreas((), (), 0, 0)
#: Fraction of an import's time that reading takes.
READING = 0.3


class Anchor(StrEnum):
    """Point of the drawing that becomes the template's (0, 0)."""

    CENTRE = "centre"
    CORNER = "corner"
    OWN = "own"


@dataclass(frozen=True)
class ImportOptions:
    """Options of an import; see the command's help."""

    scale_m: float | None = None
    line_width_m: float = 0.12
    fill: bool = False
    fill_angle_deg: float = 0.0
    anchor: Anchor = Anchor.CENTRE
    detail_m: float | None = None
    """Smallest feature that is kept; None: the width of a line; 0: all that a template may hold."""
    areas: bool = False
    """True if closed shapes become areas, not lines."""
    layers: tuple[str, ...] = ()
    """Layers to read; empty: all but the boundary's."""
    boundary: str = ""
    """Layer whose largest closed outline is the boundary; "": no boundary."""

    @property
    def detail(self) -> Detail:
        """Tolerances for the options."""
        return Detail.of(self.line_width_m if self.detail_m is None else self.detail_m)


@dataclass(frozen=True)
class Drawing:
    """Content of a file: outlines and omissions."""

    outlines: list[Outline]
    omissions: list[Omission]


@dataclass(frozen=True)
class Imported:
    """Template of a drawing, and what its author should know.

    Attributes:
        template: Template with the strokes.
        deviation_m: Maximum deviation between strokes and drawn lines, dots excluded.
        farthest_m: Position (x, y) of that, in the template's frame.
        omissions: Elements that are not or not fully painted, with the reasons.
        skipped: Names of outlines that are too small to paint or repeated.
        pieces: Number of lines and curves in the drawing.
        dots: Number of outlines painted as a dot.
        doubled: Number of outlines that run back and forth and are painted once.
        repeated: Number of outlines that lie on others.
        drawn: Lines of the drawing in the template's frame.
        left_out: Those of them that are not painted.
        found: Areas, and what their author should know.
    """

    template: Template
    deviation_m: float
    farthest_m: tuple[float, float]
    omissions: tuple[Omission, ...]
    skipped: tuple[str, ...]
    pieces: int
    dots: int
    doubled: int
    repeated: int
    drawn: tuple[Curve, ...]
    left_out: tuple[Curve, ...]
    found: FoundAreas = NO_AREAS


@dataclass
class _Collected:
    """Accumulator of an import."""

    skipped: list[str] = field(default_factory=list)
    segments: list[TemplateSegment] = field(default_factory=list)
    areas: list[tuple[Outline, list[Curve]]] = field(default_factory=list)
    kinds: Counter[StrokeKind] = field(default_factory=Counter)
    drawn: list[Curve] = field(default_factory=list)
    left_out: list[Curve] = field(default_factory=list)
    worst_m: float = 0.0
    where_m: tuple[float, float] = (0.0, 0.0)
    repeats: Repeats = field(default_factory=Repeats)

    def leave_out(self, outline: Outline, strokes: Strokes) -> None:
        self.skipped.append(outline.name)
        self.left_out += strokes.drawn

    def paint(self, outline: Outline, strokes: Strokes) -> None:
        self.kinds[strokes.kind] += 1
        self.drawn += strokes.drawn
        self.segments += [stroke_segment(outline.name, i, curve) for i, curve in enumerate(strokes.curves, 1)]
        if strokes.kind is not StrokeKind.DOT:
            worst, where = apart_m(strokes.drawn, strokes.curves)
            if worst > self.worst_m:
                self.worst_m, self.where_m = worst, where


def import_drawing(path: Path, options: ImportOptions | None = None, progress: Progress | None = None) -> Imported:
    """Import an SVG or DXF file as a template.

    Args:
        path: Path of the file.
        options: Options of the import.
        progress: Called with the fraction done, from 0 to 1, and the current step.

    Raises:
        SpecError: The file or an element of it cannot be imported.
    """
    options, progress = options or ImportOptions(), progress or _silent
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise SpecError(path.name, "", f"ends in {path.suffix!r}", f"give a file that ends in {' or '.join(READERS)}")
    _check(path, options)
    progress(0.0, "reading")
    drawing = Drawing(*reader(path, options.scale_m))
    try:
        return _imported(path, drawing, options, progress)
    except ValidationError as error:
        field, problem = error.errors()[0]["loc"], error.errors()[0]["msg"].removeprefix("Value error, ")
        place = ".".join(map(str, field))
        raise SpecError(path.name, place, f"makes no template ({problem})", "redraw or remove it") from error


def _imported(path: Path, drawing: Drawing, options: ImportOptions, progress: Progress) -> Imported:
    """Convert what was read to a template."""
    pieces = sum(len(outline.pieces) for outline in drawing.outlines)
    if pieces > MAX_PIECES:
        raise SpecError(path.name, "", f"has {pieces:,} lines and curves", f"give at most {MAX_PIECES:,}")
    fence = _fence(path.name, drawing.outlines, options)
    outlines = _chosen(path.name, drawing.outlines, options)
    away = _check_reach(path.name, outlines, fence, options.anchor)
    outlines, fence = [shifted(each, -away) for each in outlines], [shifted(each, -away) for each in fence]
    boundary = boundary_of(path.name, options.boundary, fence, options.detail.feature_m) if options.boundary else None
    shapes = [outline for outline in outlines if options.areas and is_shape(outline)]
    areas = areas_of(path.name, shapes, options.detail.feature_m) if shapes else NO_AREAS
    outlines = [outline for outline in outlines if not (options.areas and is_shape(outline))]
    found = _collected(outlines, options, progress)
    if options.fill:
        angle = math.radians(options.fill_angle_deg)
        found.segments += fill_areas(found.areas, options.line_width_m, angle, options.detail.feature_m / 2)
    if not (found.segments or areas.areas):
        raise _nothing(path.name, drawing, options.detail)
    template = Template(
        name=plain(path.stem, 100) or "drawing",
        title=plain(path.stem),
        source=f"Imported from {plain(path.name)}. Origin at the drawing's {options.anchor.value}, y up, in m.",
        line_width_m=options.line_width_m,
        segments=with_unique_ids(found.segments),
        areas=areas.areas,
        boundary=boundary,
    )
    moved, (x, y) = _anchored(path.name, template, options.anchor)
    if len(moved.segments) > MAX_SEGMENTS:
        problem = f"makes {len(moved.segments):,} strokes, more than the {MAX_SEGMENTS:,} that can be planned"
        raise SpecError(path.name, "", problem, "simplify the drawing, or give a larger --detail")
    return Imported(
        template=moved,
        deviation_m=found.worst_m,
        farthest_m=(found.where_m[0] + x, found.where_m[1] + y),
        omissions=tuple(drawing.omissions),
        skipped=tuple(found.skipped),
        pieces=pieces,
        dots=found.kinds[StrokeKind.DOT],
        doubled=found.kinds[StrokeKind.DOUBLED],
        repeated=found.repeats.count,
        drawn=_shifted(found.drawn, x, y),
        left_out=_shifted(found.left_out, x, y),
        found=areas,
    )


def _nothing(source: str, drawing: Drawing, detail: Detail) -> SpecError:
    """Create the error for a drawing with nothing to paint."""
    if drawing.omissions and not drawing.outlines:
        first = drawing.omissions[0]
        others = len(drawing.omissions) - 1
        more = f" (and {others:,} more)" if others else ""
        return SpecError(source, "", "has nothing to paint", f"{plain(first.element, 80)} {first.reason}{more}")
    if not drawing.outlines:
        return SpecError(source, "", "has nothing to paint", "draw lines that are visible")
    least = max(detail.stray_m, FINEST_M)
    remedy = f"draw lines at least {1e2 * least:.2g} cm long, or check --scale and --detail"
    return SpecError(source, "", "has nothing to paint", remedy)


def _chosen(source: str, outlines: list[Outline], options: ImportOptions) -> list[Outline]:
    """Select the outlines in the layers asked for."""
    chosen = [
        outline
        for outline in outlines
        if (_lies_in(outline, options.layers) if options.layers else not _lies_in(outline, (options.boundary,)))
    ]
    if options.boundary and not options.layers and not chosen:
        remedy = f"give --layer {options.boundary!r} as well, if it is what is painted too"
        raise SpecError(source, options.boundary, "has all that is drawn, and is the boundary's layer", remedy)
    return chosen


def _fence(source: str, outlines: list[Outline], options: ImportOptions) -> list[Outline]:
    """Check that all layers asked for exist, and return the outlines of the boundary's layer."""
    known = {name.lower(): name for outline in outlines for name in outline.layers}
    for option, layer in [("--layer", layer) for layer in options.layers] + [("--boundary", options.boundary)]:
        if layer and layer.lower() not in known:
            named = f"give one of: {', '.join(plain(name, 40) for name in list(known.values())[:_NAMED])}"
            remedy = named if known else "leave it out: the drawing has no layers"
            raise SpecError(source, option, f"is {layer!r}, in which nothing is drawn", remedy)
    return [outline for outline in outlines if _lies_in(outline, (options.boundary,))]


def _lies_in(outline: Outline, layers: tuple[str, ...]) -> bool:
    wanted = {layer.lower() for layer in layers if layer}
    return any(name.lower() in wanted for name in outline.layers)


def _silent(_fraction: float, _doing: str) -> None:
    pass


def _collected(outlines: Sequence[Outline], options: ImportOptions, progress: Progress) -> _Collected:
    """Collect the strokes of outlines, areas excluded."""
    found, detail = _Collected(), options.detail
    done, every = 0, sum(len(outline.pieces) for outline in outlines)
    for outline in outlines:
        progress(READING + (1.0 - READING) * done / max(every, 1), f"fitting {plain(outline.name, 40)}")
        done += len(outline.pieces)
        strokes = Strokes.of(outline, detail)
        area = options.fill and outline.filled and outline.closed and strokes.kind is StrokeKind.LINES
        if area:
            found.areas.append((outline, strokes.curves))
        hidden = outline.edge is Edge.NEVER and not options.fill
        unseen = hidden or strokes.kind is StrokeKind.SPECK
        if unseen or (detail.feature_m and found.repeats.has(strokes.drawn, detail)):
            found.leave_out(outline, strokes)
        elif area and outline.edge is not Edge.PAINTED:
            found.drawn += strokes.drawn
        else:
            found.paint(outline, strokes)
    return found


def _check(path: Path, options: ImportOptions) -> None:
    if not path.is_file():
        raise SpecError(str(path), "", "is not a file", "give the path of an SVG or DXF file")
    if path.stat().st_size > MAX_SPEC_BYTES:
        raise SpecError(path.name, "", f"has {path.stat().st_size:,} bytes", f"give at most {MAX_SPEC_BYTES:,}")
    if options.fill and options.areas:
        remedy = "give --fill for strokes as wide as the line, or --areas for the planner to lay the swaths"
        raise SpecError("command line", "--fill", "is given with --areas", remedy)
    scale = options.scale_m
    if scale is not None and not (math.isfinite(scale) and scale > 0.0):
        raise SpecError("command line", "--scale", f"is {scale}", "give metres per unit of the drawing, above 0")


def _check_reach(source: str, outlines: Sequence[Outline], fence: Sequence[Outline], anchor: Anchor) -> Floats:
    """Refuse outlines that lie or reach too far out, before they are fitted.

    Returns:
        (2,) middle of a drawing, m, by which one far from the origin (mostly in map coordinates) is moved first.
    """
    if not outlines:
        return np.zeros(2)
    every = np.concatenate([_extent(source, outline) for outline in outlines])
    low, high = every.min(axis=0), every.max(axis=0)
    at = _origin(source, low, high, anchor)
    for outline in fence:
        away = float(np.abs(_extent(source, outline) - at).max())
        if away > MAX_COORDINATE_M:
            remedy = "check --scale and --boundary"
            raise SpecError(source, outline.name, f"reaches {away:,.0f} m from the {anchor.value} origin", remedy)
    far = anchor is not Anchor.OWN and max(abs(low).max(), abs(high).max()) > MAX_COORDINATE_M / 2
    return np.asarray((low + high) / 2 if far else np.zeros(2))


def _extent(source: str, outline: Outline) -> Floats:
    """Points (n, 2) of an outline."""
    points = np.concatenate([sampled(piece, 9) for piece in outline.pieces])
    if not np.abs(points).max() <= MAX_REACH_M:
        raise SpecError(source, outline.name, f"is further out than {MAX_REACH_M / 1e3:,.0f} km", "check --scale")
    return points


def _origin(source: str, low: Floats, high: Floats, anchor: Anchor) -> Floats:
    """Position (x, y) of the anchor of a drawing that reaches from ``low`` to ``high``, m.

    Raises:
        SpecError: The drawing reaches too far from there.
    """
    at = {Anchor.CENTRE: (low + high) / 2, Anchor.CORNER: low, Anchor.OWN: np.zeros(2)}[anchor]
    size = max(abs(low - at).max(), abs(high - at).max())
    if size > MAX_COORDINATE_M:
        remedy = "check --scale" if anchor is not Anchor.OWN else "check --scale, or use --anchor centre"
        raise SpecError(source, "", f"reaches {size:,.0f} m from its {anchor.value} origin", remedy)
    return at


def stroke_segment(name: str, index: int, curve: Curve) -> TemplateSegment:
    """Make a segment of a stroke of an outline: its number from 1, and its curve."""
    label = name = plain(name)
    name = f"{name[:80]}-{index}"
    if curve.curvature_1pm == 0.0:
        line = LineSpec.model_construct(start=(curve.x_m, curve.y_m), end=curve.end[:2])
        return TemplateSegment.model_construct(id=name, label=label, line=line, arc=None, actuation="DISC_SPRAY")
    arc = curve.to_message().arc[0]
    spec = ArcSpec.model_construct(
        start=(arc.start.x, arc.start.y), center=(float(arc.center.x), float(arc.center.y)), sweep_angle=arc.sweep_angle
    )
    return TemplateSegment.model_construct(id=name, label=label, line=None, arc=spec, actuation="DISC_SPRAY")


def with_unique_ids(segments: list[TemplateSegment]) -> tuple[TemplateSegment, ...]:
    """Give the strokes unique ids."""
    seen: set[str] = set()
    unique = []
    for segment in segments:
        name, count = segment.id, 1
        while name in seen:
            count += 1
            name = f"{segment.id}-{count}"
        seen.add(name)
        unique.append(segment if name == segment.id else segment.model_copy(update={"id": name}))
    return tuple(unique)


def _anchored(source: str, template: Template, anchor: Anchor) -> tuple[Template, tuple[float, float]]:
    """Move a template to its anchor; return it and the displacement (m)."""
    x, y = (-float(v) for v in _origin(source, *bounds(template), anchor))
    segments = with_unique_ids([part for segment in template.segments for part in _within_reach(segment, x, y)])
    template = template.model_copy(update={"segments": segments})
    return Transform.of(x, y, 0.0).template(template), (x, y)


def _within_reach(segment: TemplateSegment, x_m: float, y_m: float) -> list[TemplateSegment]:
    """Convert an arc whose center would be too far out for a template, moved by (x, y), to lines, mostly one."""
    if segment.arc is None:
        return [segment]
    center = segment.arc.center
    if max(abs(center[0] + x_m), abs(center[1] + y_m)) <= MAX_COORDINATE_M:
        return [segment]
    curve = segment.curve()
    chord_m = math.sqrt(8 * FINEST_M / abs(curve.curvature_1pm))
    x, y, _, _ = curve.at(np.linspace(0.0, curve.length_m, math.ceil(curve.length_m / chord_m) + 1))
    ends = list(zip(x.tolist(), y.tolist(), strict=True))
    lines = (LineSpec.model_construct(start=a, end=b) for a, b in itertools.pairwise(ends))
    return [segment.model_copy(update={"line": line, "arc": None}) for line in lines]


def _shifted(curves: Sequence[Curve], x_m: float, y_m: float) -> tuple[Curve, ...]:
    return tuple(replace(curve, x_m=curve.x_m + x_m, y_m=curve.y_m + y_m) for curve in curves)
