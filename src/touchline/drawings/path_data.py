"""SVG path data: the grammar and the out-of-range rules of SVG 2, chapter 9; what stands before an error is drawn."""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from touchline.drawings.outline import Floats

_NUMBER = re.compile(r"[ \t\r\n\f]*,?[ \t\r\n\f]*([+-]?(?:[0-9]*\.[0-9]+|[0-9]+)(?:[eE][+-]?[0-9]+)?)")
_FIRST_NUMBER = re.compile(r"[ \t\r\n\f]*([+-]?(?:[0-9]*\.[0-9]+|[0-9]+)(?:[eE][+-]?[0-9]+)?)")
_FLAG = re.compile(r"[ \t\r\n\f]*,?[ \t\r\n\f]*([01])")
_COMMAND = re.compile(r"[ \t\r\n\f]*([MmZzLlHhVvCcSsQqTtAa])")
#: Arguments of each command: n a number, f a flag.
_ARGUMENTS = {"M": "nn", "L": "nn", "H": "n", "V": "n", "C": "n" * 6, "S": "n" * 4, "Q": "n" * 4, "T": "nn"}
_ARGUMENTS |= {"A": "nnnffnn", "Z": ""}


@dataclass(frozen=True)
class EllipseArc:
    """Arc center + first·cos t + second·sin t from ``begin`` to ``end`` (rad); the vectors are (2,)."""

    center: Floats
    first: Floats
    second: Floats
    begin: float
    end: float


#: Bézier curves by their control points (n, 2), a line having two; arcs.
Drawn: TypeAlias = Floats | EllipseArc


@dataclass
class SubPath:
    """Unbroken line from a moveto on."""

    start: Floats
    pieces: list[Drawn] = field(default_factory=list)
    closed: bool = False


def parse_path(text: str) -> tuple[list[SubPath], str]:
    """Parse path data; return the subpaths, and the error in the data, "" if there is none."""
    pen, read = _Pen(), 0
    for end, command, arguments in _commands(text):
        if command not in "Mm" and not pen.subpaths:
            break
        pen.draw(command, arguments)
        read = end
    rest = text[read:].strip(" \t\r\n\f")
    error = f"has an error after character {read}" if rest else ""
    return [each for each in pen.subpaths if each.pieces], error


def _commands(text: str) -> Iterator[tuple[int, str, list[float]]]:
    """Generate (end position, command, arguments); a repeated moveto is a lineto."""
    position = 0
    while found := _COMMAND.match(text, position):
        command, kinds = found[1], _ARGUMENTS[found[1].upper()]
        position, first = found.end(), True
        while (read := _arguments(text, position, kinds, first)) is not None:
            position, arguments = read
            yield position, command, arguments
            if not kinds:
                break
            first = False
            command = {"M": "L", "m": "l"}.get(command, command)
        if first and kinds:
            return


def _arguments(text: str, position: int, kinds: str, first: bool) -> tuple[int, list[float]] | None:
    values: list[float] = []
    for kind in kinds:
        pattern = _FLAG if kind == "f" else _FIRST_NUMBER if first and not values else _NUMBER
        found = pattern.match(text, position)
        if found is None:
            return None
        values.append(float(found[1]))
        position = found.end()
    return position, values


class _Pen:
    """State of a pen that executes commands."""

    def __init__(self) -> None:
        self.subpaths: list[SubPath] = []
        self._at = self._start = np.zeros(2)
        self._control: Floats | None = None
        self._last = ""
        self._open = False

    def draw(self, command: str, values: list[float]) -> None:
        kind, base = command.upper(), self._at if command.islower() else np.zeros(2)
        if kind == "M":
            self._begin(base + values)
        elif kind == "Z":
            if self._open:
                self._line(self._start)
                self.subpaths[-1].closed = True
                self._open = False
        elif kind in "LHV":
            x, y = {"L": values, "H": [values[0], math.nan], "V": [math.nan, values[0]]}[kind][:2]
            to = np.array([x, y]) + base
            self._line(np.where(np.isnan(to), self._at, to) if kind in "HV" else to)
        elif kind == "A":
            self._arc(values, base + values[5:])
        else:
            self._curve(kind, base + np.reshape(values, (-1, 2)))
        self._last = kind

    def _begin(self, at: Floats) -> None:
        self._at = self._start = at
        self.subpaths.append(SubPath(at))
        self._open = True

    def _add(self, drawn: Drawn, end: Floats) -> None:
        if not self._open:  # after a closepath the next subpath begins where the last one did
            self._begin(self._start)
        self.subpaths[-1].pieces.append(drawn)
        self._at = end

    def _line(self, end: Floats) -> None:
        self._add(np.array([self._at, end]), end)

    def _curve(self, kind: str, points: Floats) -> None:
        if kind in "ST":
            smooth = self._control is not None and self._last in ("CS" if kind == "S" else "QT")
            mirrored = 2 * self._at - self._control if smooth and self._control is not None else self._at
            points = np.vstack((mirrored, points))
        self._control = points[-2]
        self._add(np.vstack((self._at, points)), points[-1])

    def _arc(self, values: list[float], end: Floats) -> None:
        if np.array_equal(end, self._at):
            return
        radii = np.abs(values[:2])
        if not radii.all():
            self._line(end)
            return
        self._add(arc_between(self._at, end, radii, math.radians(values[2]), (bool(values[3]), bool(values[4]))), end)


def arc_between(start: Floats, end: Floats, radii: Floats, turned_rad: float, flags: tuple[bool, bool]) -> EllipseArc:
    """Elliptical arc between two points, by SVG 2, appendix B.2: radii that are too small grow.

    Args:
        start: (2,) start point.
        end: (2,) end point, different from the start.
        radii: (2,) radii, above 0.
        turned_rad: Angle of the first half-diameter.
        flags: Whether it is the larger arc, and whether its angle grows.
    """
    cos, sin = math.cos(turned_rad), math.sin(turned_rad)
    axes = np.array([[cos, sin], [-sin, cos]])
    half = axes @ (start - end) / 2
    size = float(((half / radii) ** 2).sum())
    radii = radii * math.sqrt(max(size, 1.0))
    away = math.sqrt(max(1.0 / size - 1.0, 0.0)) if size > 0.0 else 0.0
    if flags[0] == flags[1]:
        away = -away
    middle = away * radii * (half / radii)[::-1] * (1.0, -1.0)
    unit = [(side * half - middle) / radii for side in (1.0, -1.0)]
    begin, stop = (math.atan2(v[1], v[0]) for v in unit)
    sweep = (stop - begin) % math.tau
    if not flags[1]:
        sweep -= math.tau
    center = axes.T @ middle + (start + end) / 2
    return EllipseArc(center, radii[0] * axes[0], radii[1] * axes[1], begin, begin + sweep)
