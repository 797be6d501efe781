"""Drawings from other programs as templates."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np

from schemas.curves import Curve
from schemas.errors import SpecError
from schemas.placement import Transform
from schemas.plain_text import plain
from schemas.spec import MAX_SPEC_BYTES
from schemas.template import MAX_COORDINATE_M, MIN_LENGTH_M, ArcSpec, LineSpec, Template, TemplateSegment
from services.drawings.dxf import read_dxf
from services.drawings.fit import deviation_m, fit_outline
from services.drawings.hatch import Ring, hatch
from services.drawings.outline import Edge, Outline
from services.drawings.picture import bounds
from services.drawings.svg import read_svg

Reader = Callable[[Path, float | None, bool], tuple[list[Outline], list[str]]]
READERS: dict[str, Reader] = {".svg": read_svg, ".dxf": read_dxf}
#: More would take the robot days, and the planner with it.
MAX_SEGMENTS = 100_000
#: Lines and curves of a drawing; each is fitted.
MAX_PIECES = 20_000
#: More than any coordinate on Earth, and few enough for fitting to a micrometre.
MAX_REACH_M = 1e8
#: Arcs of areas become chords that stay this close.
CHORD_M = 1e-3


class Anchor(StrEnum):
    """What of the drawing becomes the template's (0, 0)."""

    CENTRE = "centre"
    CORNER = "corner"
    OWN = "own"


@dataclass(frozen=True)
class ImportOptions:
    """How a drawing is read; see the command's help."""

    scale_m: float | None = None
    line_width_m: float = 0.12
    fill: bool = False
    fill_angle_deg: float = 0.0
    anchor: Anchor = Anchor.CENTRE
    skip_others: bool = False


@dataclass(frozen=True)
class Imported:
    """A drawing's template, and what its author should know.

    Attributes:
        template: The strokes.
        deviation_m: How far the strokes are from the drawn lines at most.
        skipped: Elements left out: unpaintable ones, and those too small to paint.
    """

    template: Template
    deviation_m: float
    skipped: tuple[str, ...]


def import_drawing(path: Path, options: ImportOptions | None = None) -> Imported:
    """The template of an SVG or DXF file.

    Raises:
        SpecError: It names the file, the element and the remedy.
    """
    options = options or ImportOptions()
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise SpecError(path.name, "", f"ends in {path.suffix!r}", f"give a file that ends in {' or '.join(READERS)}")
    _check(path, options)
    outlines, skipped = reader(path, options.scale_m, options.skip_others)
    pieces = sum(len(outline.pieces) for outline in outlines)
    if pieces > MAX_PIECES:
        raise SpecError(path.name, "", f"has {pieces:,} lines and curves", f"give at most {MAX_PIECES:,}")
    segments: list[TemplateSegment] = []
    worst = 0.0
    fitted: list[tuple[Outline, list[Curve]]] = []
    for outline in outlines:
        _check_reach(path.name, outline)
        curves = fit_outline(outline)
        if not curves:
            skipped.append(outline.name)
            continue
        fitted.append((outline, curves))
        if outline.edge is Edge.NEVER and not options.fill:
            skipped.append(outline.name)
        if outline.edge is Edge.NEVER or (outline.edge is Edge.UNLESS_FILLED and options.fill):
            continue
        worst = max(worst, deviation_m(outline, curves))
        segments += [_segment(outline.name, i, curve) for i, curve in enumerate(curves, 1)]
        if len(segments) > MAX_SEGMENTS:
            raise SpecError(path.name, outline.name, f"exceeds {MAX_SEGMENTS:,} strokes", "simplify the drawing")
    if options.fill:
        segments += _areas(fitted, options)
    if not segments:
        raise SpecError(path.name, "", "has nothing to paint", "draw lines at least 1 cm long, or check --scale")
    template = Template(
        name=plain(path.stem, 100) or "drawing",
        title=plain(path.stem),
        source=f"Imported from {plain(path.name)}. Origin at the drawing's {options.anchor.value}, y up, in m.",
        line_width_m=options.line_width_m,
        segments=_unique(segments),
    )
    template = _anchored(path.name, template, options.anchor)
    return Imported(template, worst, tuple(skipped))


def _check(path: Path, options: ImportOptions) -> None:
    if not path.is_file():
        raise SpecError(str(path), "", "is not a file", "give the path of an SVG or DXF file")
    if path.stat().st_size > MAX_SPEC_BYTES:
        raise SpecError(path.name, "", f"has {path.stat().st_size:,} bytes", f"give at most {MAX_SPEC_BYTES:,}")
    scale = options.scale_m
    if scale is not None and not (math.isfinite(scale) and scale > 0.0):
        raise SpecError("command line", "--scale", f"is {scale}", "give metres per unit of the drawing, above 0")


def _check_reach(source: str, outline: Outline) -> None:
    """Far out, coordinates are too coarse to fit anything to."""
    for piece in outline.pieces:
        if isinstance(piece, Curve):
            ends = np.array([(piece.x_m, piece.y_m), piece.end[:2]])
        else:
            ends = piece.point(np.array(piece.breaks))
        if np.abs(ends).max() > MAX_REACH_M:
            raise SpecError(source, outline.name, f"is further out than {MAX_REACH_M / 1e3:,.0f} km", "check --scale")


def _segment(name: str, index: int, curve: Curve) -> TemplateSegment:
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


def _areas(fitted: list[tuple[Outline, list[Curve]]], options: ImportOptions) -> list[TemplateSegment]:
    """Strokes that fill every coloured closed element; the parts of one path and of one hatch make one area."""
    areas: dict[str, list[Ring]] = {}
    for outline, curves in fitted:
        if outline.filled and outline.closed:
            areas.setdefault(outline.area or outline.name, []).append(_ring(curves))
    segments = []
    for name, rings in ((plain(area), rings) for area, rings in areas.items()):
        strokes = hatch(rings, options.line_width_m, math.radians(options.fill_angle_deg))
        for index, (start, end) in enumerate(strokes, 1):
            line = LineSpec(start=start, end=end)
            segments.append(TemplateSegment(id=f"{name[:70]}-fill-{index}", label=f"{name}, area", line=line))
    return segments


def _ring(curves: list[Curve]) -> Ring:
    points = []
    for curve in curves:
        sagitta_step = math.sqrt(8 * CHORD_M / abs(curve.curvature_1pm)) if curve.curvature_1pm else curve.length_m
        count = max(2, math.ceil(curve.length_m / max(sagitta_step, MIN_LENGTH_M)) + 1)
        x, y, _, _ = curve.at(np.linspace(0.0, curve.length_m, count))
        points.append(np.column_stack((x, y)))
    return np.concatenate(points)


def _unique(segments: list[TemplateSegment]) -> tuple[TemplateSegment, ...]:
    """The same strokes under ids of their own."""
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


def _anchored(source: str, template: Template, anchor: Anchor) -> Template:
    """The template about its anchor; only now can be said whether it lies too far out."""
    low, high = bounds(template)
    at = {Anchor.CENTRE: (low + high) / 2, Anchor.CORNER: low, Anchor.OWN: np.zeros(2)}[anchor]
    size = max(abs(low - at).max(), abs(high - at).max())
    if size > MAX_COORDINATE_M:
        remedy = "check --scale" if anchor is not Anchor.OWN else "check --scale, or use --anchor centre"
        raise SpecError(source, "", f"reaches {size:,.0f} m from its {anchor.value} origin", remedy)
    return Transform.of(-float(at[0]), -float(at[1]), 0.0).template(template)
