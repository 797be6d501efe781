"""DXF drawings as outlines: the lines and curves of a plot of model space, blocks included."""

import logging
import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from touchline.drawings.deviation import sampled
from touchline.drawings.omissions import Omission, Unclear
from touchline.drawings.outline import Edge, FillRule, Floats, Outline, Piece, Smooth, bezier, ellipse
from touchline.schemas.curves import Curve
from touchline.schemas.errors import SpecError

#: Maximum nesting of blocks.
MAX_DEPTH = 16
#: Maximum number of entities, counting each copy by an INSERT.
MOST_ENTITIES = 20_000
#: Maximum size of a binary file, whose entities cannot be counted before it is read.
MOST_BINARY_BYTES = 1_000_000
#: A point is painted as a stroke of this length along x, m.
POINT_M = 0.24
FLAT = (0.0, 0.0, 1.0)
#: Layer of a drawing program's own points, which no plot shows.
NEVER_PLOTTED = "defpoints"
_SOLIDS = frozenset(("SOLID", "TRACE"))
_CURVES = _SOLIDS | {"LINE", "ARC", "CIRCLE", "LWPOLYLINE", "POLYLINE", "ELLIPSE", "SPLINE", "HELIX"}
#: Entities that show nothing on paper.
_SILENT = frozenset(("VIEWPORT", "ATTDEF", "LIGHT", "SUN", "SECTIONOBJECT"))


#: Exceptions that the library raises for invalid values.
_STUMBLES = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)


def read_dxf(path: Path, scale_m: float | None) -> tuple[list[Outline], list[Omission]]:
    """Read a DXF file: outlines in metres, and omissions.

    Args:
        path: Path of the file.
        scale_m: Metres per drawing unit; None: from the header's $INSUNITS.

    Raises:
        SpecError: The file is no DXF, states no unit, or exceeds a limit.
    """
    _check_size(path)
    try:
        return _read(path, scale_m)
    except SpecError:
        raise
    except Exception as error:  # whatever damage leads the library into
        raise SpecError(path.name, "", f"is not a readable DXF ({error})", "save it as DXF R2000 or newer") from error


def _read(path: Path, scale_m: float | None) -> tuple[list[Outline], list[Omission]]:
    drawing, damaged = _opened(path)
    scale = scale_m if scale_m is not None else _metres_per_unit(path.name, drawing)
    reader = _Reader(path.name, scale, drawing)
    if damaged:
        reader.omissions.append(Omission(path.name, f"is damaged ({damaged}); what could be read of it is painted"))
    _give_blocks_a_height(drawing)
    _expand_arrays(path.name, drawing)
    outlines = [outline for entity in drawing.modelspace() for outline in reader.outlines(entity, (), "0")]
    if not len(drawing.modelspace()):
        for layout in drawing.layouts:
            if not layout.is_modelspace and len(layout):
                reader.omissions.append(Omission(layout.name, "is a layout on paper; draw in model space"))
    return outlines, reader.omissions


def _opened(path: Path) -> tuple[Any, str]:
    """Document of the library, and the damage of the file; "" if there is none."""
    from ezdxf import recover
    from ezdxf.filemanagement import readfile
    from ezdxf.lldxf.const import DXFError

    logging.getLogger("ezdxf").addHandler(logging.NullHandler())  # what it mends is reported here
    try:
        return readfile(path), ""
    except (DXFError, *_STUMBLES) as error:
        drawing, _ = recover.readfile(path)
        return drawing, " ".join(str(error).split())


def _give_blocks_a_height(drawing: Any) -> None:
    """Replace z scales of 0, which planar programs write and with which no block can be transformed."""
    for entity in drawing.entitydb.values():
        if entity.dxftype() == "INSERT" and entity.dxf.zscale == 0.0:
            entity.dxf.zscale = 1.0


def _expand_arrays(source: str, drawing: Any) -> None:
    """Expand arrays of inserts within blocks, whose spacing ezdxf would not scale with the block."""
    arrays = [
        (block, entity)
        for block in drawing.blocks
        if not block.is_any_layout
        for entity in block
        if entity.dxftype() == "INSERT" and entity.mcount > 1
    ]
    if sum(array.mcount for _, array in arrays) > MOST_ENTITIES:
        raise SpecError(source, "", f"makes more than {MOST_ENTITIES:,} entities of its blocks", "simplify it")
    for block, array in arrays:
        for copy in array.multi_insert():
            block.add_entity(copy)
        block.delete_entity(array)


def _check_size(path: Path) -> None:
    """Refuse a file with too many entities before it is read."""
    data = path.read_bytes()
    if data.startswith(b"AutoCAD Binary DXF"):
        if len(data) > MOST_BINARY_BYTES:
            remedy = f"save it as text, or give at most {MOST_BINARY_BYTES:,}"
            raise SpecError(path.name, "", f"is a binary DXF of {len(data):,} bytes", remedy)
        return
    entities = sum(line.strip() == b"0" for line in data.splitlines()[::2])
    if entities > 2 * MOST_ENTITIES:  # tables, vertices and ends are among them
        raise SpecError(path.name, "", f"has {entities:,} entities", f"give at most {2 * MOST_ENTITIES:,}")


def _metres_per_unit(source: str, drawing: Any) -> float:
    from ezdxf import units
    from ezdxf.enums import InsertUnits

    unit = int(drawing.header.get("$INSUNITS", 0))
    if unit == 0:
        raise SpecError(source, "$INSUNITS", "states no unit", "give the metres of one drawing unit with --scale")
    try:
        return float(units.conversion_factor(InsertUnits(unit), InsertUnits.Meters))
    except (ValueError, TypeError, KeyError) as error:
        raise SpecError(
            source, "$INSUNITS", f"is {unit}", "give the metres of one drawing unit with --scale"
        ) from error


def _is_mesh(entity: Any, kind: str) -> bool:
    """True if a polyline holds the vertices of a surface."""
    return kind == "POLYLINE" and bool(entity.is_polygon_mesh or entity.is_poly_face_mesh)


class _Reader:
    """Converter of entities to outlines in metres, with a list of omissions."""

    def __init__(self, source: str, scale: float, drawing: Any) -> None:
        self.source, self.scale = source, scale
        self.omissions: list[Omission] = []
        self._frozen = {layer.dxf.name.lower() for layer in drawing.layers if layer.is_frozen()}
        hidden = {layer.dxf.name.lower() for layer in drawing.layers if layer.is_off() or not layer.dxf.plot}
        self._hidden = hidden | self._frozen | {NEVER_PLOTTED}
        self._count = self._entities = 0

    def outlines(self, entity: Any, blocks: tuple[str, ...], layer: str) -> Iterator[Outline]:
        """Generate the outlines of an entity that a plot shows.

        Args:
            entity: Entity of a layout or block.
            blocks: Names of the enclosing blocks.
            layer: Layer of the innermost insert, which entities of layer 0 take on.
        """
        own = str(entity.dxf.get("layer", "0"))
        layer = layer if own == "0" else own
        if entity.dxf.get("invisible", 0):
            return
        if entity.dxftype() == "INSERT":
            # If its own layer is off, or not plotted, only the entities that take it on are hidden.
            if layer.lower() not in self._frozen:
                yield from self._block(entity, self._counted(entity), blocks, layer)
        elif layer.lower() not in self._hidden:
            name = self._counted(entity)
            try:
                found = list(self._lines(entity, name))
            except Unclear as reason:
                self._omit(name, str(reason))
            except _STUMBLES as error:
                self._omit(name, f"cannot be followed ({error}); redraw or remove it")
            else:
                yield from (replace(outline, layers=(layer,)) for outline in found)

    def _omit(self, name: str, reason: str) -> None:
        self.omissions.append(Omission(name, reason))

    def _counted(self, entity: Any) -> str:
        """Count an entity, and return its name."""
        self._entities += 1
        if self._entities > MOST_ENTITIES:
            raise SpecError(self.source, "", f"makes more than {MOST_ENTITIES:,} entities of its blocks", "simplify it")
        return self._name(entity, entity.dxftype())

    def _lines(self, entity: Any, name: str) -> Iterator[Outline]:
        kind = entity.dxftype()
        if kind == "HATCH":
            yield from self._hatch(entity, name)
        elif kind == "POINT":
            x, y = self._at(entity.dxf.location)
            yield Outline(name, (Curve.from_line((x - POINT_M / 2, y), (x + POINT_M / 2, y)),))
        elif kind in _CURVES and not _is_mesh(entity, kind):
            pieces = tuple(self._pieces(entity, kind))
            if pieces and not all(np.isfinite(sampled(piece, 3)).all() for piece in pieces):
                raise Unclear("has a coordinate that is not finite; mend or remove it")
            filled = kind in _SOLIDS
            if pieces:
                edge = Edge.UNLESS_FILLED if filled else Edge.PAINTED
                yield Outline(name, pieces, closed=filled or _closed(entity, kind), filled=filled, edge=edge)
        elif kind not in _SILENT:
            raise Unclear(f"is {kind}, which is no line; explode it or convert it to lines")

    def _name(self, entity: Any, kind: str) -> str:
        handle = entity.dxf.get("handle")
        self._count += 1
        return f"{kind.lower()}-{handle}" if handle else f"{kind.lower()}-{self._count}"

    def _block(self, entity: Any, name: str, blocks: tuple[str, ...], layer: str) -> Iterator[Outline]:
        from ezdxf.xclip import XClip

        block = str(entity.dxf.get("name", "")).lower()
        clip = XClip(entity)
        if block in blocks:
            self._omit(name, "inserts the block that it is in; remove it")
        elif entity.block() is None:
            self._omit(name, f"inserts the block {block[:40]!r}, which is not there; remove it")
        elif len(blocks) == MAX_DEPTH:
            self._omit(name, "nests blocks too deeply; explode the blocks")
        elif clip.has_clipping_path and clip.is_clipping_enabled:
            self._omit(name, "is a clipped block; explode it and cut the lines")
        else:
            yield from self._copies(entity, name, (*blocks, block), layer)

    def _copies(self, entity: Any, name: str, blocks: tuple[str, ...], layer: str) -> Iterator[Outline]:
        if entity.mcount > MOST_ENTITIES:
            problem = f"repeats a block {entity.mcount:,} times"
            raise SpecError(self.source, name, problem, f"give at most {MOST_ENTITIES:,}")
        copies = entity.multi_insert() if entity.mcount > 1 else (entity,)
        for part in (part for copy in copies for part in copy.virtual_entities()):
            # The parts of a block have the handles of its definition, which may be inserted often: name them anew.
            self._count += 1
            for outline in self.outlines(part, blocks, layer):
                prefix = f"{name}-{self._count}"
                area = outline.area or outline.name
                yield replace(outline, name=f"{prefix}-{outline.name}", area=f"{prefix}-{area}")

    def _hatch(self, entity: Any, name: str) -> Iterator[Outline]:
        from ezdxf import path

        for index, ring in enumerate(path.from_hatch(entity), 1):
            pieces = tuple(self._path(ring))
            if pieces:
                part = f"{name}-{index}"
                yield Outline(part, pieces, True, filled=True, edge=Edge.NEVER, area=name, rule=FillRule.EVEN_ODD)

    def _pieces(self, entity: Any, kind: str) -> Iterator[Piece]:
        flat = tuple(entity.dxf.get("extrusion", FLAT)) == FLAT
        if kind in ("LWPOLYLINE", "POLYLINE") and flat and _is_flat(entity, kind):
            for part in entity.virtual_entities():
                yield from self._pieces(part, part.dxftype())
        elif kind == "LINE":
            yield from self._line(entity.dxf.start, entity.dxf.end)
        elif kind in ("ARC", "CIRCLE") and flat:
            yield self._arc(entity, kind)
        elif kind == "ELLIPSE":
            yield self._ellipse(entity)
        elif kind in ("SPLINE", "HELIX"):
            yield self._spline(entity)
        else:
            from ezdxf import path

            yield from self._path(path.make_path(entity))

    def _arc(self, entity: Any, kind: str) -> Piece:
        center, radius = self._at(entity.dxf.center), self.scale * float(entity.dxf.radius)
        if radius <= 0.0:
            raise Unclear(f"has a radius of {radius:g} m; give it a positive one")
        begin = math.radians(entity.dxf.start_angle) if kind == "ARC" else 0.0
        sweep = math.radians(entity.dxf.end_angle) - begin if kind == "ARC" else 2 * math.pi
        start = (center[0] + radius * math.cos(begin), center[1] + radius * math.sin(begin))
        return Curve.from_arc(start, center, sweep % (2 * math.pi) or 2 * math.pi)

    def _ellipse(self, entity: Any) -> Piece:
        center = self._at(entity.dxf.center)
        major, up = entity.dxf.major_axis, entity.dxf.extrusion
        minor = up.normalize().cross(major) * entity.dxf.ratio
        axes = [(self.scale * v.x, self.scale * v.y) for v in (major, minor)]
        begin, end = float(entity.dxf.start_param), float(entity.dxf.end_param)
        sweep = (end - begin) % (2 * math.pi) or 2 * math.pi
        return ellipse(center, axes[0], axes[1], begin, begin + sweep)

    def _spline(self, entity: Any) -> Piece:
        try:
            tool = entity.construction_tool()
        except ValueError as error:
            raise Unclear(f"is no usable spline ({error}); redraw or remove it") from error

        def every(order: int, t: Floats) -> Floats:
            found = tool.derivatives(t.tolist(), 1)
            return self.scale * np.array([(v[order].x, v[order].y) for v in found], dtype=np.float64)

        # The curve is defined between these knots, which are the first and the last one only if it is clamped.
        knots = tool.knots()
        low, high = float(knots[tool.order - 1]), float(knots[tool.count])
        inside = sorted({low, high, *(float(k) for k in knots if low < k < high)})
        breaks = [float(b) for a, c in pairwise(inside) for b in np.linspace(a, c, 3)[:-1]]
        return Smooth(lambda t: every(0, t), lambda t: every(1, t), (*breaks, inside[-1]))

    def _path(self, drawn: Any) -> Iterator[Piece]:
        """Convert the library's path to lines and Bézier curves."""
        here = drawn.start
        for command in drawn.commands():
            controls = [command.ctrl] if hasattr(command, "ctrl") else []
            controls = [command.ctrl1, command.ctrl2] if hasattr(command, "ctrl1") else controls
            if controls:
                yield bezier([self._at(point) for point in (here, *controls, command.end)])
            else:
                yield from self._line(here, command.end)
            here = command.end

    def _line(self, start: Any, end: Any) -> Iterator[Curve]:
        first, last = self._at(start), self._at(end)
        if first != last:
            yield Curve.from_line(first, last)

    def _at(self, point: Any) -> tuple[float, float]:
        x, y = self.scale * float(point.x), self.scale * float(point.y)
        if not (math.isfinite(x) and math.isfinite(y)):
            raise Unclear("has a coordinate that is not finite; mend or remove it")
        return (x, y)


def _is_flat(entity: Any, kind: str) -> bool:
    return kind == "LWPOLYLINE" or bool(entity.is_2d_polyline)


def _closed(entity: Any, kind: str) -> bool:
    if kind in ("LWPOLYLINE", "POLYLINE", "SPLINE"):
        return bool(entity.closed if kind != "POLYLINE" else entity.is_closed)
    return kind == "CIRCLE"
