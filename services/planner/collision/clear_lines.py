"""Parts of lines that can be painted around obstacles, and the stretches that cannot."""

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from touchline.schemas.curves import Curve
from touchline.schemas.line_parts import part_of, redrawn
from touchline.schemas.messages import LeftOutStretch
from touchline.schemas.swath_ids import line_id_of, line_part_id
from touchline.schemas.template import Template, TemplateSegment
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.collision.checker import MARGIN_M, CollisionChecker, first_touch
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath
from touchline.services.planner.limits import Limits
from touchline.services.planner.swaths.chains import GAP_M
from touchline.services.planner.swaths.offset import Stroke, modes
from touchline.services.planner.transitions.transitions import BRAKING_SHARE

PART_MIN_M = 0.3
"""Shorter parts are left out."""
SHORTER_M = 0.3
"""A part that cannot be reached or left is shortened by this at obstructed ends, a few times; then by ever more."""
_EVEN = 6
_JOINED = 3
"""So many times a part keeps its ends at which another part of its line goes on."""
STEP_M = 0.002
"""Greatest motion of any point of the body between poses at which a line's clearance is looked up."""
OVERLAP_M = 0.005
"""Overlap of parts that meet, painted in opposite directions."""

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
        tight: For each line, whether there is no room to brake before its begin, and beyond its end.
    """

    lines: tuple[TemplateSegment, ...]
    spans: tuple[tuple[Span, ...], ...]
    strokes: tuple[Stroke | None, ...]
    checker: CollisionChecker | None
    shortened_before: int = 0
    tight: tuple[tuple[bool, bool], ...] = ()

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
        hit = self.checker.collision(_driven(robot))
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
            (from_m, to_m), length_m = self.spans[number][part], self.lines[number].curve().length_m
            tight = self.tight[number] if self.tight else (False, False)
            first, last = from_m > 0.0 or tight[0], to_m < length_m or tight[1]
            if self.shortened_before < _JOINED:
                first, last = (
                    cut and not self._goes_on(number, part, at) for cut, at in ((first, from_m), (last, to_m))
                )
            shorter = from_m + by_m * first, to_m - by_m * last
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

    def _goes_on(self, number: int, part: int, at_m: float) -> bool:
        """True if another part of the line goes on at an end of this one."""
        others = (span for other, span in enumerate(self.spans[number]) if other != part)
        return any(a <= at_m <= b for a, b in others)


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
    tight = [(False, False)] * len(lines)
    if checker is None:
        return ReachableLines(lines, tuple(spans), tuple(strokes), None)
    found: list[tuple[Span, ...]] = [*spans]
    for number, either in enumerate(modes(lines, vehicle, limits.curvature_max_1pm)):
        choice = either if turned else either[:1]
        if clear := [stroke for stroke in choice if not checker.collision(stroke.path)]:
            tight[number] = _tight_ends(clear, checker, limits)
        else:
            passable = [span for stroke in choice for span in _passable(stroke, checker, limits)]
            shares = _joined(passable, PART_MIN_M / lengths[number])
            overlap_m = [OVERLAP_M if k and a == shares[k - 1][1] else 0.0 for k, (a, _) in enumerate(shares)]
            parts = (
                (a * lengths[number] - over, b * lengths[number])
                for (a, b), over in zip(shares, overlap_m, strict=True)
            )
            found[number] = tuple(parts)
            strokes[number] = choice[0]
    return ReachableLines(lines, tuple(found), tuple(strokes), checker, tight=tuple(tight))


def _tight_ends(choice: Sequence[Stroke], checker: CollisionChecker, limits: Limits) -> tuple[bool, bool]:
    """Return whether there is no room to brake before the begin of an open line, and beyond its end, in any mode."""
    if math.dist(choice[0].nozzle.end[:2], (choice[0].nozzle.x_m, choice[0].nozzle.y_m)) <= GAP_M:
        return False, False
    found = list[tuple[bool, bool]]()
    for stroke in choice:
        room_m, length_m = _braking_m(stroke, limits), stroke.robot.length_m
        rooms = part_of(stroke.robot, -room_m, 0.0), part_of(stroke.robot, length_m, length_m + room_m)
        before, beyond = (bool(checker.collision(_driven(room))) for room in rooms)
        found.append((beyond, before) if stroke.flipped else (before, beyond))
    return all(before for before, _ in found), all(beyond for _, beyond in found)


def _joined(spans: Sequence[Span], least: float) -> list[Span]:
    """Longest spans, and what others reach beyond them, if that is at least `least`."""
    found = list[Span]()
    for span in sorted(spans, key=lambda span: span[0] - span[1]):
        borders = [span[0], *(border for each in sorted(found) for border in each), span[1]]
        beyond = [(max(a, span[0]), min(b, span[1])) for a, b in zip(borders[::2], borders[1::2], strict=True)]
        found += [(a, b) for a, b in beyond if b - a >= least]
    return sorted(found)


def clear_lines(template: Template, vehicle: Vehicle, limits: Limits) -> tuple[TemplateSegment, ...]:
    """Parts of a template's lines along which the body touches no outline; see `reachable_lines`."""
    return reachable_lines(template.segments, template, vehicle, limits).segments


def _passable(stroke: Stroke, checker: CollisionChecker, limits: Limits) -> list[Span]:
    """Fractions of a stroke, from and to in the line's own direction, that can be driven at speed, reached and left.

    An obstructed end is reached from a standstill straight behind it, or left to one straight ahead of it, because from
    there the robot can always back out the way it came.
    """
    found, length_m = list[Span](), stroke.robot.length_m
    room_m = _braking_m(stroke, limits) + STEP_M
    for from_m, to_m in _clear(stroke, checker, room_m):
        first_m = 0.0 if from_m <= 0.0 else from_m + room_m
        last_m = length_m if to_m >= length_m else to_m - room_m
        if last_m > first_m:
            found.append((first_m / length_m, last_m / length_m))
    return [(1.0 - b, 1.0 - a) for a, b in reversed(found)] if stroke.flipped else found


def _driven(robot: Curve) -> PiecePath:
    """Path of the robot along a curve."""
    return PiecePath(PathPose(robot.x_m, robot.y_m, robot.heading_rad), (Piece(robot.length_m, robot.curvature_1pm),))


def _braking_m(stroke: Stroke, limits: Limits) -> float:
    """Length of the stroke's extension on which the robot brakes."""
    return limits.stopping_distance_m(limits.steady_speed_mps(stroke.robot.curvature_1pm)) / BRAKING_SHARE


def clear_modes(choice: list[Stroke], checker: CollisionChecker | None) -> list[Stroke]:
    """Modes of a line along which the body touches no outline; all of them if there is none.

    With the others, lines that continue each other would be joined in a direction in which only some can be painted.
    Circles, which have more than two modes, are joined to nothing.
    """
    if checker is None or len(choice) > 2:
        return choice
    return [stroke for stroke in choice if not checker.collision(stroke.path)] or choice


def with_room(choice: list[Stroke], checker: CollisionChecker | None, limits: Limits) -> list[Stroke]:
    """Modes of a part of a line with room to brake straight on at both ends; all of them if none has.

    The others would only be tried and found to lead nowhere.
    """
    if checker is None or not line_id_of(choice[0].id):
        return choice
    found = list[Stroke]()
    for stroke in choice:
        room_m = _braking_m(stroke, limits)
        span = next(_clear(stroke, checker, room_m), (0.0, 0.0))
        if span[0] <= -room_m and span[1] >= stroke.robot.length_m + room_m:
            found.append(stroke)
    return found or choice


def _clear(stroke: Stroke, checker: CollisionChecker, room_m: float) -> Iterator[Span]:
    """Intervals (m, along the robot's curve) in which the body is clear, up to `room_m` beyond both ends.

    Clearance of the margin and half a step at points a step apart means clearance of the margin in between.
    """
    bend, length_m = abs(stroke.robot.curvature_1pm), stroke.robot.length_m
    count = 2 + math.ceil((length_m + 2.0 * room_m) * (1.0 + bend * checker.reach_m) / STEP_M)
    at_m = np.linspace(-room_m, length_m + room_m, count)
    poses = np.column_stack(stroke.robot.at(at_m)[:3])
    first = 0
    while first < count:
        hit, _ = first_touch(
            poses[first:], checker.edges, checker.owner, checker.bounded, checker.body, MARGIN_M + 0.5 * STEP_M
        )
        last = count if hit < 0 else first + hit
        if last - 1 > first:
            yield float(at_m[first]), float(at_m[last - 1])
        first = last + 1
