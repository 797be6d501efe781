"""Parts of a template's lines that a robot has not painted, by its own paint record of one drive after another."""

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, NamedTuple

import numpy as np

from touchline.core.arcs import abreast, unit
from touchline.core.intervals import Intervals
from touchline.onboard.interface import PaintBelief
from touchline.schemas.curves import Curve
from touchline.schemas.line_parts import DONE_M, gaps_between, part_of, redrawn, with_overlap
from touchline.schemas.messages import LeftOutStretch, Trajectory
from touchline.schemas.swath_ids import line_part_id, whole_line_id
from touchline.schemas.template import Polygon, Template, TemplateSegment
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.paint.targets import nozzle_curve, segment_length_m
from touchline.services.robot_sim.way_round.remains import PLAN, Clearances, LeftOut, Rest

PASSING_BY: Final = Clearances(left_m=0.03, far_side_m=0.0)
"""Clearances of a robot that passes things on the side that it sees; plans keep less than `left_m` from outlines."""
BEFORE_M: Final = 0.5
SKIPPED_M: Final = 1.0
"""Parts of a line before and beyond the place that a robot has reached, or comes to next, which are skipped at once."""
NEXT_M: Final = 3.0
"""Distance from the robot within which it is about to paint what comes next."""
CLOSED_M: Final = 1e-6
"""Distance of the ends of a circle."""
Span = tuple[float, float]


class Gap(NamedTuple):
    """Part of a line that is not painted.

    Attributes:
        line_id: Id of the line of the template.
        from_m, to_m: Its ends along the line.
        reason: Id of the outline beside which it lies, `operator` or `plan`; "" if none explains most of it.
    """

    line_id: str
    from_m: float
    to_m: float
    reason: str


@dataclass
class UnpaintedLines:
    """Unpainted parts of the lines of a template; see `Remains`.

    Attributes:
        template: The whole template, in the map frame.
        vehicle: Vehicle that paints.
        reasons: Stretches left out by plans, or by the operator, and why; later ones count.
    """

    template: Template
    vehicle: Vehicle
    reasons: list[Gap] = field(default_factory=list)

    clearances: Clearances = field(default=PASSING_BY, init=False)

    def __post_init__(self) -> None:
        """Begin with no paint at all."""
        self._lines = {segment.id: segment for segment in self.template.segments}
        self._painted = {name: Intervals() for name in self._lines}
        self._skipped = {name: Intervals() for name in self._lines}
        self._retries = False

    def enter(self, trajectory: Trajectory, painted: PaintBelief, reached_m: float) -> None:
        """See `Remains`; the paint record tells what is painted."""
        shares = dict(zip(painted.ids, painted.fractions, strict=True))
        for segment in trajectory.path.segments:
            line = self._line_of(segment.id)
            if line is not None and shares.get(segment.id, 0.0) > 0.0:
                length_m = segment_length_m(segment)
                self._add(line, nozzle_curve(segment, 0.0, length_m, self.vehicle), shares[segment.id])

    def curve_of(self, line_id: str) -> Curve:
        """Return the curve of a line."""
        return self._lines[line_id].curve()

    def _line_of(self, name: str) -> TemplateSegment | None:
        """Line of the template of which a path segment is a part, or a part of a part."""
        return self._lines.get(whole_line_id(name, self._lines))

    def _add(self, line: TemplateSegment, stroke: Curve, share: float) -> None:
        """Enter the first share of a stroke, driven along its line or against it."""
        curve = line.curve()
        low_m, high_m = _stations_m(curve, replace(stroke, length_m=share * stroke.length_m))
        spans = self._painted[line.id]
        spans.add(min(max(low_m, 0.0), curve.length_m), max(min(high_m, curve.length_m), 0.0))
        x, y, _ = curve.end
        if math.hypot(x - curve.x_m, y - curve.y_m) < CLOSED_M:  # a circle that was begun elsewhere
            spans.add(0.0, max(high_m - curve.length_m, 0.0))
            spans.add(curve.length_m + min(low_m, 0.0), curve.length_m)

    @property
    def done(self) -> float:
        """See `Remains`; the painted length."""
        return sum(to_m - from_m for spans in self._painted.values() for from_m, to_m in spans.spans())

    def note_plan(self, trajectory: Trajectory) -> None:
        """See `Remains`."""
        planned = UnpaintedLines(self.template, self.vehicle)
        ids = tuple(segment.id for segment in trajectory.path.segments)
        planned.enter(trajectory, PaintBelief(ids, [1.0] * len(ids)), math.inf)
        self.reasons += [gap._replace(reason=PLAN) for gap in planned.gaps()]

    def note(
        self, rest: Rest, seen: Sequence[Polygon], trajectory: Trajectory, stretches: Iterable[LeftOutStretch]
    ) -> None:
        """See `Remains`; the planner gives the stretches that it leaves out, and beside what."""
        own = {segment.id: segment.curve() for segment in rest.template.segments}
        for name, part in own.items():
            line = self._line_of(name)
            if line is not None:
                begin_m = station_m(line.curve(), part.x_m, part.y_m)
                self.reasons = [each for each in self.reasons if not _within(each, line.id, begin_m, part.length_m)]
        for each in stretches:
            line = self._line_of(each.line_id)
            if line is not None and each.line_id in own:
                part = own[each.line_id]
                begin_m = station_m(line.curve(), part.x_m, part.y_m)
                from_m, to_m = begin_m + each.from_m, begin_m + each.to_m
                self.reasons.append(Gap(line.id, from_m, to_m, each.outline))
                if not self._retries:
                    self._skipped[line.id].add(from_m, to_m)

    def gaps(self) -> list[Gap]:
        """Return all unpainted parts with the reason that explains most of each."""
        return self._gaps_beside({})

    def _gaps_beside(self, others: Mapping[str, Sequence[Span]]) -> list[Gap]:
        """Return all parts that are neither painted nor among others of their line, as `gaps`."""
        return [
            Gap(name, from_m, to_m, self._reason(name, from_m, to_m))
            for name, line in self._lines.items()
            for from_m, to_m in gaps_between(
                [*self._painted[name].spans(), *others.get(name, ())], line.curve().length_m
            )
        ]

    @property
    def undone(self) -> LeftOut:
        """See `Remains`."""
        return LeftOut(stretches=tuple(map(self._stretch, self.gaps())))

    @property
    def left_out(self) -> LeftOut:
        """See `Remains`."""
        return LeftOut(stretches=tuple(map(self._stretch, self._gaps_left_out)))

    @property
    def reasons_left(self) -> set[str]:
        """See `Remains`."""
        return {gap.reason for gap in self._gaps_left_out}

    @property
    def _gaps_left_out(self) -> list[Gap]:
        """Unpainted parts of the noted stretches."""
        parts = [
            Gap(gap.line_id, max(gap.from_m, each.from_m), min(gap.to_m, each.to_m), each.reason)
            for gap in self.gaps()
            for each in self.reasons
            if each.line_id == gap.line_id
        ]
        return [part for part in parts if part.to_m - part.from_m > DONE_M]

    def _stretch(self, gap: Gap) -> LeftOutStretch:
        """Return a gap with the places of its ends."""
        x, y, _, _ = self.curve_of(gap.line_id).at(np.array([gap.from_m, gap.to_m]))
        ends = {"from_x_m": x[0], "from_y_m": y[0], "to_x_m": x[1], "to_y_m": y[1]}
        places = {name: float(value) for name, value in ends.items()}
        return LeftOutStretch(line_id=gap.line_id, outline=gap.reason, from_m=gap.from_m, to_m=gap.to_m, **places)

    def _reason(self, name: str, from_m: float, to_m: float) -> str:
        found, most_m = "", 0.5 * (to_m - from_m)
        for each in self.reasons:
            shared_m = min(each.to_m, to_m) - max(each.from_m, from_m)
            if each.line_id == name and shared_m >= most_m:
                found, most_m = each.reason, shared_m
        return found

    @property
    def unexplained(self) -> bool:
        """See `Remains`; more than half of a gap."""
        noted = {name: [each[1:3] for each in self.reasons if each.line_id == name] for name in self._lines}
        rest = self._gaps_beside(noted)
        for gap in self.gaps():
            parts = (each for each in rest if each.line_id == gap.line_id and gap.from_m <= each.from_m < gap.to_m)
            if sum(each.to_m - each.from_m for each in parts) > 0.5 * (gap.to_m - gap.from_m):
                return True
        return False

    def skip(self, trajectory: Trajectory, reached_m: float, place: tuple[float, float], reason: str) -> bool:
        """See `Remains`."""
        at_m = 0.0
        for segment in trajectory.path.segments:
            length_m, line = segment_length_m(segment), self._line_of(segment.id)
            if line is not None and at_m + length_m > reached_m + DONE_M:
                next_m = max(reached_m - at_m, 0.0)
                first_m, last_m = max(next_m - BEFORE_M, 0.0), min(next_m + SKIPPED_M, length_m)
                stroke = nozzle_curve(segment, first_m, last_m, self.vehicle)
                if math.dist((stroke.x_m, stroke.y_m), place) > NEXT_M:
                    return False
                low_m, high_m = _stations_m(line.curve(), stroke)
                self._skipped[line.id].add(low_m, high_m)
                self.reasons.append(Gap(line.id, low_m, high_m, reason))
                return True
            at_m += length_m
        return False

    def retry(self) -> None:
        """See `Remains`."""
        self._skipped, self._retries = {name: Intervals() for name in self._lines}, True

    def give_reason(self, reason: str) -> None:
        """See `Remains`."""
        self.reasons += [gap._replace(reason=reason) for gap in self.gaps() if not gap.reason]

    def leave_out(self, outlines: Collection[str], reason: str) -> None:
        """See `Remains`."""
        self.reasons = [each._replace(reason=reason) if each.reason in outlines else each for each in self.reasons]

    def rest(self, without: Collection[str], seen: Sequence[Polygon]) -> Rest | None:
        """See `Remains`; each gap has an overlap at its joints, and keeps the id of its line if it is the only one."""
        unskipped = self._gaps_beside({name: spans.spans() for name, spans in self._skipped.items()})
        wanted = [gap for gap in unskipped if gap.reason not in without]
        if not wanted:
            return None
        segments = list[TemplateSegment]()
        for name, line in self._lines.items():
            own = [gap for gap in wanted if gap.line_id == name]
            for number, gap in enumerate(own, start=1):
                part_id = name if len(own) == 1 else line_part_id(name, number)
                segments.append(redrawn(line, with_overlap(line.curve(), gap[1:3]), part_id))
        return Rest(self.template.model_copy(update={"segments": tuple(segments)}))


def painted_lines(template: Template, gaps: Sequence[LeftOutStretch]) -> Template:
    """Return the template of what is painted, to evaluate the paint by.

    Args:
        template: The whole template.
        gaps: Unpainted parts of its lines.
    """
    segments = list[TemplateSegment]()
    for line in template.segments:
        curve = line.curve()
        missing = [(gap.from_m, gap.to_m) for gap in gaps if gap.line_id == line.id]
        if not missing:
            segments.append(line)
            continue
        for number, (from_m, to_m) in enumerate(gaps_between(missing, curve.length_m), start=1):
            segments.append(redrawn(line, part_of(curve, from_m, to_m), line_part_id(line.id, number)))
    return template.model_copy(update={"segments": tuple(segments)})


def _within(gap: Gap, name: str, begin_m: float, length_m: float) -> bool:
    """Return whether the middle of a gap lies in a part of a line."""
    return gap.line_id == name and begin_m <= 0.5 * (gap.from_m + gap.to_m) <= begin_m + length_m


def _stations_m(curve: Curve, stroke: Curve) -> tuple[float, float]:
    """Return the ends of a stroke, driven along a line or against it, along the line (m), the lower one first."""
    from_m = station_m(curve, stroke.x_m, stroke.y_m)
    along = math.cos(stroke.heading_rad - float(curve.at(from_m)[2])) > 0.0
    return (from_m, from_m + stroke.length_m) if along else (from_m - stroke.length_m, from_m)


def station_m(curve: Curve, x_m: float, y_m: float) -> float:
    """Return the arc length along a line or an arc that is nearest to a point, map frame."""
    row = np.array((curve.x_m, curve.y_m, curve.heading_rad, curve.curvature_1pm, curve.length_m))
    return float(abreast(complex(x_m, y_m), row, unit(curve.heading_rad)))
