"""View model of a job: template and planned path as polylines and table rows."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.curves import Curve, spin_rad, wrap_angle
from touchline.schemas.messages.plan_messages import PlanReport
from touchline.schemas.messages.turf_tank import LinearDirection, Segment, Trajectory
from touchline.schemas.plain_text import plain
from touchline.schemas.template import Template
from touchline.tui.raster import Polyline
from touchline.tui.robot import ShownPose

SAGITTA_M = 0.004
"""Maximum distance of a drawn chord from its arc: less than a dot at the closest useful zoom."""

PLAIN_LABELS = frozenset({"transition", "run-in", "run-out"})
"""Labels of segments without painting."""


@dataclass(frozen=True)
class LineRow:
    """Painted segment as a row of the table."""

    segment_id: str
    label: str
    length_m: float


@dataclass(frozen=True, eq=False)
class TemplateView:
    """Template with its text, and polylines by segment id and area id."""

    template: Template
    text: str
    lines: dict[str, Polyline] = field(repr=False)

    @classmethod
    def of(cls, template: Template, text: str) -> TemplateView:
        """Sample all segments and the edges of all areas."""
        lines = {segment.id: sample([segment.curve()]) for segment in template.segments}
        return cls(template, text, lines | {area.id: sample(area.edges()) for area in template.areas})

    @cached_property
    def line(self) -> Polyline:
        """All segments."""
        return merge(list(self.lines.values()))

    @cached_property
    def limits(self) -> Polyline:
        """Outlines of boundary and obstacles."""
        shapes = [*self.template.obstacles, *([self.template.boundary] if self.template.boundary is not None else [])]
        return Polyline.of([_ring(shape.corners) for shape in shapes])

    @cached_property
    def lengths_m(self) -> dict[str, float]:
        """Length of every segment in metres."""
        return {segment.id: segment.curve().length_m for segment in self.template.segments}

    @cached_property
    def rows(self) -> tuple[LineRow, ...]:
        """Segments in the template's order, then the areas, whose length only the plan has."""
        lines = (
            LineRow(segment.id, plain(segment.label or segment.id), self.lengths_m[segment.id])
            for segment in self.template.segments
        )
        return (*lines, *(LineRow(area.id, plain(area.id), math.nan) for area in self.template.areas))


@dataclass(frozen=True, eq=False)
class PathView:
    """Trajectory with the axle's path by segment index, and flags of transitions."""

    trajectory: Trajectory = field(repr=False)
    report: PlanReport | None
    lines: tuple[Polyline, ...] = field(repr=False)
    transition: tuple[bool, ...] = field(repr=False)
    rows: tuple[LineRow, ...]
    """Painted segments in driving order."""
    goals: tuple[int, ...] = field(repr=False)
    """For each segment the row that it paints or leads to; the number of rows after the last one."""

    @classmethod
    def of(cls, trajectory: Trajectory, template: TemplateView | None, report: PlanReport | None = None) -> PathView:
        """Sample all segments; one is painted if the template has it, or an area of which it is a swath.

        Without a template its label decides.

        Raises:
            ValueError: A curve is not valid.
        """
        segments = trajectory.path.segments
        lengths = template.lengths_m if template else {}
        paints = template.template.paints if template else None
        driven = tuple(not paints(each.id) if paints else each.label in PLAIN_LABELS for each in segments)
        rows = tuple(
            LineRow(each.id, plain(each.label or each.id), lengths.get(each.id, _swath_m(each) if paints else math.nan))
            for each, transition in zip(segments, driven, strict=True)
            if not transition
        )
        lines = tuple(
            sample([Curve.from_message(segment.curve)] if spin_rad(segment.curve) is None else [])
            for segment in segments
        )
        goals = tuple(np.cumsum([0, *(not transition for transition in driven)])[:-1].tolist())
        return cls(trajectory, report, lines, driven, rows, goals)

    @cached_property
    def transitions(self) -> Polyline:
        """Path driven without painting."""
        return merge([line for line, plain in zip(self.lines, self.transition, strict=True) if plain])

    @cached_property
    def painting(self) -> Polyline:
        """Path of the axle while painting."""
        return merge([line for line, plain in zip(self.lines, self.transition, strict=True) if not plain])

    @cached_property
    def destination(self) -> ShownPose | None:
        """Pose of the robot at the end; None for a path of turns on the spot only, which has no start heading."""
        turn_rad = 0.0
        for segment in reversed(self.trajectory.path.segments):
            spin = spin_rad(segment.curve)
            if spin is None:
                x, y, heading = Curve.from_message(segment.curve).end
                reverse_rad = math.pi if segment.direction.value == LinearDirection.BACKWARD else 0.0
                return ShownPose(x, y, wrap_angle(heading + reverse_rad + turn_rad))
            turn_rad += spin
        return None


@dataclass(frozen=True, eq=False)
class JobView:
    """Template and, once it is planned, its path; or a path only."""

    template: TemplateView | None = None
    path: PathView | None = None

    @property
    def drives(self) -> bool:
        """True for a drive without work."""
        return self.template is None and self.path is not None and not self.path.rows


NOTHING = JobView()


def _ring(corners: tuple[tuple[float, float], ...]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Convert a closed outline to a stroke."""
    x, y = np.array((*corners, corners[0])).T
    return x, y


def _swath_m(segment: Segment) -> float:
    """Length of the robot's path along a swath of an area."""
    return Curve.from_message(segment.curve).length_m


def sample(curves: list[Curve]) -> Polyline:
    """Sample curves as separate strokes, bends finely enough for the eye."""
    strokes: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = []
    for curve in curves:
        bend = abs(curve.curvature_1pm)
        step = math.sqrt(8 * SAGITTA_M / bend) if bend > 1e-9 else math.inf
        count = min(max(math.ceil(curve.length_m / step), 1), 2000)
        x, y, _, _ = curve.at(np.linspace(0.0, curve.length_m, count + 1))
        strokes.append((np.asarray(x), np.asarray(y)))
    return Polyline.of(strokes)


def merge(lines: list[Polyline]) -> Polyline:
    """Concatenate polylines without joining them."""
    if not lines:
        return Polyline.of([])
    return Polyline(
        np.concatenate([line.x_m for line in lines]),
        np.concatenate([line.y_m for line in lines]),
        np.concatenate([line.joined for line in lines]),
    )
