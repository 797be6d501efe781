"""The drawing board of the fields: strokes by name, and the shapes that several sports share."""

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from touchline.schemas.placement import Transform
from touchline.schemas.spec import Spec
from touchline.schemas.template import ArcSpec, LineSpec, Template, TemplateSegment

Point = tuple[float, float]

INCH_M, FOOT_M, YARD_M = 0.0254, 0.3048, 0.9144

_COMPASS = {"north": "south", "south": "north", "east": "west", "west": "east"}


class Parameters(Spec):
    """Base of a sport's parameters: lengths in metres, each with the range that its rules allow."""


@dataclass
class Sheet:
    """Collects painted strokes in the order in which they are to be painted.

    Points are the centres of strokes in metres, x east along the field, y north, unless a method says otherwise.
    """

    line_width_m: float
    segments: list[TemplateSegment] = field(default_factory=list)

    @property
    def half(self) -> float:
        """Half the line width: from a line's edge to its centre."""
        return self.line_width_m / 2

    def line(self, name: str, label: str, start: Point, end: Point) -> None:
        """A straight stroke."""
        self.segments.append(TemplateSegment(id=name, label=label, line=LineSpec(start=start, end=end)))

    def arc(self, name: str, label: str, start: Point, center: Point, sweep_rad: float) -> None:
        """A circular stroke, counter-clockwise for a positive sweep."""
        spec = ArcSpec(start=start, center=center, sweep_angle=sweep_rad)
        self.segments.append(TemplateSegment(id=name, label=label, arc=spec))

    def arc_between(self, name: str, label: str, center: Point, radius_m: float, angles_rad: Point) -> None:
        """A circular stroke from the first to the second of two polar angles."""
        first, last = angles_rad
        start = (center[0] + radius_m * math.cos(first), center[1] + radius_m * math.sin(first))
        self.arc(name, label, start, center, last - first)

    def circle(self, name: str, label: str, center: Point, radius_m: float) -> None:
        """A full circle from its westernmost point, clockwise: the robot drives outside, its nozzle on the right."""
        self.arc(name, label, (center[0] - radius_m, center[1]), center, -2 * math.pi)

    def polyline(self, name: str, label: str, sides: Sequence[str], points: Sequence[Point]) -> None:
        """Straight strokes from point to point, called ``name-side``; those that go on fill the corner between."""
        closed = points[0] == points[-1]
        for index, (side, start, end) in enumerate(zip(sides, points, points[1:], strict=False)):
            grown = end
            if closed or index < len(sides) - 1:
                grow = self.half / math.dist(start, end)
                grown = (end[0] + grow * (end[0] - start[0]), end[1] + grow * (end[1] - start[1]))
            self.line(f"{name}-{side}", f"{label}, {side} side", start, grown)

    def band(self, name: str, label: str, start: Point, end: Point, width_m: float) -> None:
        """A straight line wider than a stroke: as few parallel strokes as cover it, there and back."""
        count = max(1, math.ceil(width_m / self.line_width_m - 1e-6))
        spread = max(width_m - self.line_width_m, 0.0)
        length = math.dist(start, end)
        left = (-(end[1] - start[1]) / length, (end[0] - start[0]) / length)
        for index in range(count):
            shift = spread * (index / (count - 1) - 0.5) if count > 1 else 0.0
            ends = [(p[0] + shift * left[0], p[1] + shift * left[1]) for p in (start, end)]
            suffix = f"-{index + 1}" if count > 1 else ""
            self.line(name + suffix, label, ends[index % 2], ends[1 - index % 2])

    def spot(self, name: str, label: str, center: Point, diameter_m: float) -> None:
        """A filled disc, as parallel strokes along x."""
        count = max(1, round(diameter_m / self.line_width_m))
        for index in range(count):
            y = (index - (count - 1) / 2) * self.line_width_m
            reach = math.sqrt((diameter_m / 2) ** 2 - y**2)
            ends = [(center[0] - reach, center[1] + y), (center[0] + reach, center[1] + y)]
            self.line(f"{name}-{index + 1}" if count > 1 else name, label, ends[index % 2], ends[1 - index % 2])

    def boundary(self, length_m: float, width_m: float, names: tuple[str, str], *, inside: bool) -> None:
        """The four boundary lines, clockwise from the north-east, so that the robot drives outside of them.

        Args:
            length_m: Measured to the outside of the lines if they are ``inside``, else to their inside.
            width_m: Likewise.
            names: Of the short (east, west) and of the long (north, south) lines.
            inside: Whether the lines belong to the field.
        """
        sign = 1 if inside else -1
        a, b = length_m / 2 - sign * self.half, width_m / 2 - sign * self.half
        corner = a + self.half
        short, long = names
        self.line(f"{slug(short)}-east", f"{short} (east)", (a, b), (a, -b))
        self.line(f"{slug(long)}-south", f"{long} (south)", (corner, -b), (-corner, -b))
        self.line(f"{slug(short)}-west", f"{short} (west)", (-a, -b), (-a, b))
        self.line(f"{slug(long)}-north", f"{long} (north)", (-corner, b), (corner, b))

    def half_turn(self, strokes: Iterable[TemplateSegment]) -> None:
        """Add ``strokes`` turned by 180° about the origin: what was north is south, what was west is east."""
        turn = Transform.half_turn()
        self.segments += [
            turn.segment(s).model_copy(update={"id": _opposite(s.id), "label": _opposite(s.label)}) for s in strokes
        ]

    def template(self, name: str, title: str, source: str) -> Template:
        """Template of all that has been drawn."""
        return Template(
            name=name, title=title, source=source, line_width_m=self.line_width_m, segments=tuple(self.segments)
        )


def rectangle(length_m: float, width_m: float) -> tuple[Point, ...]:
    """Its corners about the origin, counter-clockwise from the south-west."""
    x, y = length_m / 2, width_m / 2
    return (-x, -y), (x, -y), (x, y), (-x, y)


def slug(text: str) -> str:
    """``"Goal line"`` as ``"goal-line"``."""
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")


def metres(value: float) -> str:
    """A length for a title: at most two decimals."""
    return f"{value:.2f}".rstrip("0").rstrip(".")


def _opposite(text: str) -> str:
    return re.sub("|".join(_COMPASS), lambda found: _COMPASS[found[0]], text)
