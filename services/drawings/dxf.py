"""DXF drawings as outlines: what lies in model space, blocks included, on layers that are on."""

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from touchline.schemas.curves import Curve
from touchline.schemas.errors import SpecError
from touchline.services.drawings.outline import Edge, FillRule, Floats, Outline, Piece, Smooth, bezier, ellipse

#: How deep blocks may hold blocks.
MAX_DEPTH = 16
#: Entities, each copy that an INSERT makes counted.
MOST_ENTITIES = 20_000
#: A binary file's entities cannot be counted before it is read.
MOST_BINARY_BYTES = 1_000_000
#: A point is painted as a stroke of this length along x, m.
POINT_M = 0.24
FLAT = (0.0, 0.0, 1.0)
_CURVES = frozenset(("LINE", "ARC", "CIRCLE", "LWPOLYLINE", "POLYLINE", "ELLIPSE", "SPLINE"))


def read_dxf(path: Path, scale_m: float | None, skip_others: bool) -> tuple[list[Outline], list[str]]:
    """(outlines in metres, names of what was skipped) of a DXF file.

    Args:
        path: The file.
        scale_m: Metres per drawing unit; None: from the header's $INSUNITS.
        skip_others: Leave out texts, dimensions and whatever else is no line instead of refusing them.

    Raises:
        SpecError: It is no DXF, it states no unit, or an entity cannot be painted; it names which.
    """
    _check_size(path)
    try:
        return _read(path, scale_m, skip_others)
    except SpecError:
        raise
    except Exception as error:  # whatever damage leads the library into
        raise SpecError(path.name, "", f"is not a readable DXF ({error})", "save it as DXF R2000 or newer") from error


def _read(path: Path, scale_m: float | None, skip_others: bool) -> tuple[list[Outline], list[str]]:
    from ezdxf.filemanagement import readfile

    drawing = readfile(path)
    scale = scale_m if scale_m is not None else _metres_per_unit(path.name, drawing)
    reader = _Reader(path.name, scale, skip_others)
    _give_blocks_a_height(drawing)
    _expand_arrays(path.name, drawing)
    hidden = {layer.dxf.name.lower() for layer in drawing.layers if layer.is_off() or layer.is_frozen()}
    outlines = [
        outline
        for entity in drawing.modelspace()
        if str(entity.dxf.get("layer", "0")).lower() not in hidden
        for outline in reader.outlines(entity, 0, "0")
    ]
    return outlines, reader.skipped


def _give_blocks_a_height(drawing: Any) -> None:
    """Programs that draw in a plane write a z scale of 0, with which no block can be transformed; heights go unused."""
    for entity in drawing.entitydb.values():
        if entity.dxftype() == "INSERT" and entity.dxf.zscale == 0.0:
            entity.dxf.zscale = 1.0


def _expand_arrays(source: str, drawing: Any) -> None:
    """Insert one by one what blocks insert in rows and columns: ezdxf would not scale their spacing with the block."""
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
    """Refuse, before it is read, a file of more entities than are painted."""
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
    """Whether a polyline holds the vertices of a surface."""
    return kind == "POLYLINE" and bool(entity.is_polygon_mesh or entity.is_poly_face_mesh)


class _Reader:
    """Turns entities into outlines in metres; what it may skip it lists."""

    def __init__(self, source: str, scale: float, skip_others: bool) -> None:
        self.source, self.scale, self.skip_others = source, scale, skip_others
        self.skipped: list[str] = []
        self._count = self._entities = 0

    def outlines(self, entity: Any, depth: int, layer: str) -> Iterator[Outline]:
        """Those of an entity; `layer` is that of the block that it is in, which entities of layer 0 take on."""
        own = str(entity.dxf.get("layer", "0"))
        layer = layer if own == "0" else own
        if entity.dxftype() == "INSERT":
            yield from self._block(entity, self._counted(entity), depth, layer)
        else:
            for outline in self._lines(entity):
                yield replace(outline, layers=(layer,))

    def _counted(self, entity: Any) -> str:
        """The name of one more entity."""
        self._entities += 1
        if self._entities > MOST_ENTITIES:
            raise SpecError(self.source, "", f"makes more than {MOST_ENTITIES:,} entities of its blocks", "simplify it")
        return self._name(entity, entity.dxftype())

    def _lines(self, entity: Any) -> Iterator[Outline]:
        kind, name = entity.dxftype(), self._counted(entity)
        if kind == "HATCH":
            yield from self._hatch(entity, name)
        elif kind == "POINT":
            x, y = self._at(name, entity.dxf.location)
            yield Outline(name, (Curve.from_line((x - POINT_M / 2, y), (x + POINT_M / 2, y)),))
        elif kind in _CURVES and not _is_mesh(entity, kind):
            pieces = tuple(self._pieces(entity, kind, name))
            if pieces:
                yield Outline(name, pieces, closed=_closed(entity, kind))
        elif self.skip_others:
            self.skipped.append(name)
        else:
            remedy = "explode it or convert it to lines, or leave it out with --skip-others"
            raise SpecError(self.source, name, "cannot be painted", remedy)

    def _name(self, entity: Any, kind: str) -> str:
        handle = entity.dxf.get("handle")
        self._count += 1
        return f"{kind.lower()}-{handle}" if handle else f"{kind.lower()}-{self._count}"

    def _block(self, entity: Any, name: str, depth: int, layer: str) -> Iterator[Outline]:
        if depth == MAX_DEPTH:
            raise SpecError(self.source, name, "nests blocks too deeply", "explode the blocks")
        if entity.mcount > MOST_ENTITIES:
            problem = f"repeats a block {entity.mcount:,} times"
            raise SpecError(self.source, name, problem, f"give at most {MOST_ENTITIES:,}")
        copies = entity.multi_insert() if entity.mcount > 1 else (entity,)
        for part in (part for copy in copies for part in copy.virtual_entities()):
            # The parts of a block have the handles of its definition, which may be inserted often: name them anew.
            self._count += 1
            for outline in self.outlines(part, depth + 1, layer):
                prefix = f"{name}-{self._count}"
                area = outline.area or outline.name
                yield replace(outline, name=f"{prefix}-{outline.name}", area=f"{prefix}-{area}")

    def _hatch(self, entity: Any, name: str) -> Iterator[Outline]:
        from ezdxf import path

        for index, ring in enumerate(path.from_hatch(entity), 1):
            pieces = tuple(self._path(ring, name))
            if pieces:
                part = f"{name}-{index}"
                yield Outline(part, pieces, True, filled=True, edge=Edge.NEVER, area=name, rule=FillRule.EVEN_ODD)

    def _pieces(self, entity: Any, kind: str, name: str) -> Iterator[Piece]:
        flat = tuple(entity.dxf.get("extrusion", FLAT)) == FLAT
        if kind in ("LWPOLYLINE", "POLYLINE") and flat and _is_flat(entity, kind):
            for part in entity.virtual_entities():
                yield from self._pieces(part, part.dxftype(), name)
        elif kind == "LINE":
            yield from self._line(name, entity.dxf.start, entity.dxf.end)
        elif kind in ("ARC", "CIRCLE") and flat:
            yield self._arc(entity, kind, name)
        elif kind == "ELLIPSE":
            yield self._ellipse(entity, name)
        elif kind == "SPLINE":
            yield self._spline(entity, name)
        else:
            from ezdxf import path

            yield from self._path(path.make_path(entity), name)

    def _arc(self, entity: Any, kind: str, name: str) -> Piece:
        center, radius = self._at(name, entity.dxf.center), self.scale * float(entity.dxf.radius)
        if radius <= 0.0:
            raise SpecError(self.source, name, f"has a radius of {radius:g} m", "give it a positive radius")
        begin = math.radians(entity.dxf.start_angle) if kind == "ARC" else 0.0
        sweep = math.radians(entity.dxf.end_angle) - begin if kind == "ARC" else 2 * math.pi
        start = (center[0] + radius * math.cos(begin), center[1] + radius * math.sin(begin))
        return Curve.from_arc(start, center, sweep % (2 * math.pi) or 2 * math.pi)

    def _ellipse(self, entity: Any, name: str) -> Piece:
        center = self._at(name, entity.dxf.center)
        major, up = entity.dxf.major_axis, entity.dxf.extrusion
        minor = up.normalize().cross(major) * entity.dxf.ratio
        axes = [(self.scale * v.x, self.scale * v.y) for v in (major, minor)]
        begin, end = float(entity.dxf.start_param), float(entity.dxf.end_param)
        sweep = (end - begin) % (2 * math.pi) or 2 * math.pi
        return ellipse(center, axes[0], axes[1], begin, begin + sweep)

    def _spline(self, entity: Any, name: str) -> Piece:
        try:
            tool = entity.construction_tool()
        except ValueError as error:
            raise SpecError(self.source, name, f"is no usable spline ({error})", "redraw or remove it") from error

        def every(order: int, t: Floats) -> Floats:
            found = tool.derivatives(t.tolist(), 1)
            return self.scale * np.array([(v[order].x, v[order].y) for v in found], dtype=np.float64)

        # The curve is defined between these knots, which are the first and the last one only if it is clamped.
        knots = tool.knots()
        low, high = float(knots[tool.order - 1]), float(knots[tool.count])
        inside = sorted({low, high, *(float(k) for k in knots if low < k < high)})
        breaks = [float(b) for a, c in pairwise(inside) for b in np.linspace(a, c, 3)[:-1]]
        return Smooth(lambda t: every(0, t), lambda t: every(1, t), (*breaks, inside[-1]))

    def _path(self, drawn: Any, name: str) -> Iterator[Piece]:
        """The library's path: lines and Bézier curves."""
        here = drawn.start
        for command in drawn.commands():
            controls = [command.ctrl] if hasattr(command, "ctrl") else []
            controls = [command.ctrl1, command.ctrl2] if hasattr(command, "ctrl1") else controls
            if controls:
                yield bezier([self._at(name, point) for point in (here, *controls, command.end)])
            else:
                yield from self._line(name, here, command.end)
            here = command.end

    def _line(self, name: str, start: Any, end: Any) -> Iterator[Curve]:
        first, last = self._at(name, start), self._at(name, end)
        if first != last:
            yield Curve.from_line(first, last)

    def _at(self, name: str, point: Any) -> tuple[float, float]:
        x, y = self.scale * float(point.x), self.scale * float(point.y)
        if not (math.isfinite(x) and math.isfinite(y)):
            raise SpecError(self.source, name, "has a coordinate that is not finite", "mend or remove it")
        return (x, y)


def _is_flat(entity: Any, kind: str) -> bool:
    return kind == "LWPOLYLINE" or bool(entity.is_2d_polyline)


def _closed(entity: Any, kind: str) -> bool:
    if kind in ("LWPOLYLINE", "POLYLINE", "SPLINE"):
        return bool(entity.closed if kind != "POLYLINE" else entity.is_closed)
    return kind == "CIRCLE"
