"""Parts of lines that can be painted around obstacles, and the stretches that cannot."""

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from touchline.schemas.curves import Curve, wrap_angle
from touchline.schemas.messages import LeftOutStretch
from touchline.schemas.swath_ids import line_part_id
from touchline.schemas.template import ArcSpec, LineSpec, Template, TemplateSegment
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.collision.checker import MARGIN_M, CollisionChecker, first_touch
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath
from touchline.services.planner.limits import Limits
from touchline.services.planner.swaths.offset import Stroke, modes

PART_MIN_M = 0.3
"""Shorter parts are left out."""
SHORTER_M = 0.3
"""A part that cannot be reached or left is shortened by this at obstructed ends, a few times; then by ever more."""
_EVEN = 6

Span = tuple[float, float]


@dataclass(frozen=True)
class ReachableLines:
    """Lines, and the intervals along each in which the body touches no outline.

    Attributes:
        lines: Lines of the template.
        spans: For each line, the parts that are painted (m, along the line in its own direction).
        strokes: For each line, an obstructed stroke; None if nothing obstructs it.
        checker: Checker of boundary and obstacles; None if there are none.
        shortened_before: Number of times that parts have been shortened.
    """

    lines: tuple[TemplateSegment, ...]
    spans: tuple[tuple[Span, ...], ...]
    strokes: tuple[Stroke | None, ...]
    checker: CollisionChecker | None
    shortened_before: int = 0

    @property
    def segments(self) -> tuple[TemplateSegment, ...]:
        """Unobstructed lines unchanged, and numbered parts of the others."""
        return tuple(segment for _, _, segment in self._parts())

    def _parts(self) -> Iterator[tuple[int, int, TemplateSegment]]:
        """Number of the line, of the part, and the part as a segment."""
        for number, (line, spans) in enumerate(zip(self.lines, self.spans, strict=True)):
            curve = line.curve()
            for part, (from_m, to_m) in enumerate(spans):
                whole = (from_m, to_m) == (0.0, curve.length_m)
                name = line_part_id(line.id, part + 1)
                yield number, part, line if whole else redrawn(line, part_of(curve, from_m, to_m), name)

    @property
    def left_out(self) -> tuple[LeftOutStretch, ...]:
        """Stretches that are not painted."""
        found = list[LeftOutStretch]()
        for number, (line, spans) in enumerate(zip(self.lines, self.spans, strict=True)):
            curve = line.curve()
            borders = [0.0, *(border for span in spans for border in span), curve.length_m]
            for from_m, to_m in zip(borders[::2], borders[1::2], strict=True):
                if to_m > from_m:
                    x, y, _, _ = curve.at(np.array([from_m, to_m]))
                    ends = {"from_x_m": x[0], "from_y_m": y[0], "to_x_m": x[1], "to_y_m": y[1]}
                    places = {name: float(value) for name, value in ends.items()}
                    outline = self._outline(number, (from_m, to_m))
                    found.append(LeftOutStretch(line_id=line.id, outline=outline, from_m=from_m, to_m=to_m, **places))
        return tuple(found)

    def _outline(self, number: int, span: Span) -> str:
        """Id of the outline that obstructs a stretch; "" if one is only too near to drive around."""
        stroke, line = self.strokes[number], self.lines[number].curve()
        if stroke is None or self.checker is None:
            return ""
        shares = [at / line.length_m for at in span]
        first, last = (1.0 - shares[1], 1.0 - shares[0]) if stroke.flipped else shares
        robot = part_of(stroke.robot, first * stroke.robot.length_m, last * stroke.robot.length_m)
        start = PathPose(robot.x_m, robot.y_m, robot.heading_rad)
        hit = self.checker.collision(PiecePath(start, (Piece(robot.length_m, robot.curvature_1pm),)))
        return hit.outline if hit else ""

    def shortened(self, ids: Collection[str], unreached: str) -> "ReachableLines":
        """Shorten parts between which there is no path, or leave one out if none of them has an obstructed end.

        Args:
            ids: Ids of the parts.
            unreached: Id of the part that is left out if none can be shortened.
        """
        by_m = SHORTER_M * 2.0 ** max(self.shortened_before + 1 - _EVEN, 0)
        names = {segment.id: (number, part) for number, part, segment in self._parts()}
        spans = [list(each) for each in self.spans]
        changed = False
        for number, part in {names[name] for name in ids}:
            (from_m, to_m), length_m = spans[number][part], self.lines[number].curve().length_m
            shorter = from_m + by_m * (from_m > 0.0), to_m - by_m * (to_m < length_m)
            changed |= shorter != (from_m, to_m)
            spans[number][part] = shorter
        if not changed:
            number, part = names[unreached]
            spans[number][part] = 0.0, 0.0
        least_m = [min(PART_MIN_M, line.curve().length_m) for line in self.lines]
        kept = tuple(
            tuple((a, b) for a, b in each if b - a >= least) for each, least in zip(spans, least_m, strict=True)
        )
        return replace(self, spans=kept, shortened_before=self.shortened_before + 1)


def reachable_lines(
    lines: tuple[TemplateSegment, ...], template: Template, vehicle: Vehicle, limits: Limits, *, turned: bool = True
) -> ReachableLines:
    """Find the parts of lines along which the body touches no outline, each in the direction in which it is longest.

    Args:
        lines: Lines to paint.
        template: Template with boundary and obstacles.
        vehicle: Vehicle that paints.
        limits: Limits of the plan.
        turned: Whether a line may be painted against its direction if it can be painted along it, too.

    Raises:
        PlanningError: An arc is too tight for the robot.
    """
    lengths = [line.curve().length_m for line in lines]
    checker = CollisionChecker.of(template, vehicle)
    spans, strokes = [((0.0, length),) for length in lengths], list[Stroke | None]([None] * len(lines))
    if checker is None:
        return ReachableLines(lines, tuple(spans), tuple(strokes), None)
    found: list[tuple[Span, ...]] = [*spans]
    for number, either in enumerate(modes(lines, vehicle, limits.curvature_max_1pm)):
        choice = either if turned else either[:1]
        if all(checker.collision(stroke.path) for stroke in choice):
            shares = _longest([span for stroke in choice for span in _clear(stroke, checker)])
            parts = ((a * lengths[number], b * lengths[number]) for a, b in shares)
            found[number] = tuple((a, b) for a, b in parts if b - a >= PART_MIN_M)
            strokes[number] = choice[0]
    return ReachableLines(lines, tuple(found), tuple(strokes), checker)


def _longest(spans: Sequence[Span]) -> list[Span]:
    """Longest span of each group of overlapping ones."""
    groups = list[list[Span]]()
    for span in sorted(spans):
        if groups and span[0] < max(b for _, b in groups[-1]):
            groups[-1].append(span)
        else:
            groups.append([span])
    return [max(group, key=lambda span: span[1] - span[0]) for group in groups]


def clear_lines(template: Template, vehicle: Vehicle, limits: Limits) -> tuple[TemplateSegment, ...]:
    """Parts of a template's lines along which the body touches no outline; see `reachable_lines`."""
    return reachable_lines(template.segments, template, vehicle, limits).segments


def _clear(stroke: Stroke, checker: CollisionChecker) -> list[Span]:
    """Fractions of a stroke, from and to in the line's own direction, along which the body is clear.

    Clearance of twice the margin at points no further apart than that means clearance of the margin in between.
    """
    bend = abs(stroke.robot.curvature_1pm)
    count = 2 + math.ceil(stroke.robot.length_m * (1.0 + bend * checker.reach_m) / (2.0 * MARGIN_M))
    share = np.linspace(0.0, 1.0, count)
    poses = np.column_stack(stroke.robot.at(share * stroke.robot.length_m)[:3])
    edges, owner, body, bounded = checker.edges, checker.owner, checker.body, checker.bounded
    clear = [first_touch(poses[k : k + 1], edges, owner, bounded, body, 2.0 * MARGIN_M)[0] < 0 for k in range(count)]
    found = list(_runs(share.tolist(), clear))
    return [(1.0 - b, 1.0 - a) for a, b in reversed(found)] if stroke.flipped else found


def _runs(share: Sequence[float], clear: Sequence[bool]) -> Iterator[Span]:
    """Intervals of the runs of clear points, single points left out."""
    state = np.concatenate(([False], clear, [False])).astype(np.int8)
    begins, ends = np.flatnonzero(np.diff(state) == 1).tolist(), np.flatnonzero(np.diff(state) == -1).tolist()
    for first, last in zip(begins, ends, strict=True):
        if last - 1 > first:
            yield share[first], share[last - 1]


def part_of(curve: Curve, from_m: float, to_m: float) -> Curve:
    """Cut a part out of a line or an arc."""
    x, y, heading, _ = (float(value) for value in curve.at(from_m))
    return replace(curve, x_m=x, y_m=y, heading_rad=wrap_angle(heading), length_m=to_m - from_m)


def redrawn(segment: TemplateSegment, curve: Curve, name: str = "") -> TemplateSegment:
    """Copy of a segment along another curve, with another id if that is given."""
    line: LineSpec | None = None
    arc: ArcSpec | None = None
    start = curve.x_m, curve.y_m
    if curve.curvature_1pm == 0.0:
        line = LineSpec(start=start, end=curve.end[:2])
    else:
        radius = 1.0 / curve.curvature_1pm
        center = start[0] - radius * math.sin(curve.heading_rad), start[1] + radius * math.cos(curve.heading_rad)
        arc = ArcSpec(start=start, center=center, sweep_angle=curve.curvature_1pm * curve.length_m)
    return segment.model_copy(update={"id": name or segment.id, "line": line, "arc": arc})
