"""The paint's figures against a raster of the true nozzle and valve, which shares no code with the project's own."""

import math
from itertools import pairwise

import numpy as np
import pytest

from tests.with_full import with_full
from touchline.schemas.messages import PlanOptions
from touchline.schemas.scenario import Scenario
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import plan
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.paint.metrics import paint_metrics
from touchline.services.robot_sim.world.body import STEPS, TRACE_EAST, TRACE_NORTH, TRACE_SPRAYING

CELL_M = 0.001
TURN_RAD = 0.3217  # so that no edge lies along the raster's rows, which would be counted a cell too far or too near


def at(x, y):
    cos, sin = math.cos(TURN_RAD), math.sin(TURN_RAD)
    return (cos * x - sin * y, sin * x + cos * y)


def line(name, start, end):
    return {"id": name, "line": {"start": at(*start), "end": at(*end)}}


def arc(name, start, center, sweep):
    return {"id": name, "arc": {"start": at(*start), "center": at(*center), "sweep_angle": sweep}}


TEMPLATES = {
    "line": [line("a", (0, 0), (4, 0))],
    "crossing": [line("a", (0, 0), (3, 0)), line("b", (1.4, -1), (1.8, 1.5))],
    "corner": [line("a", (0, 0), (2.5, 0)), line("b", (2.5, 0), (2.5, 2))],
    "circle": [arc("a", (1.0, 0), (0, 0), 2 * math.pi)],
    "bend": [line("a", (0, 0), (1.5, 0)), arc("b", (1.5, 0), (1.5, 1.2), math.pi / 2)],
}


def driven(template, seed):
    """The emulator after the drive, and (n, 3) of every millisecond: the true nozzle, and how much it sprayed."""
    vehicle = Vehicle()
    emulator = Emulator(vehicle, Scenario(seed=seed))
    emulator.load(plan(template, vehicle, PlanOptions()).trajectory, template)
    emulator.start()
    rows = []
    while emulator.active:
        emulator.tick()
        trace = emulator.world.trace
        assert len(trace) == STEPS + 1
        rows.append(trace[1:, [TRACE_EAST, TRACE_NORTH, TRACE_SPRAYING]].copy())
    return emulator, np.concatenate(rows)


def sprayed(rows):
    """Polylines of the nozzle while paint flowed, a point every 10 ms."""
    flowing = np.flatnonzero(rows[:, 2] > 0.0)
    for run in np.split(flowing, np.flatnonzero(np.diff(flowing) > 1) + 1):
        picked = np.unique(np.append(np.arange(run[0] - 1, run[-1], STEPS), run[-1]))
        yield rows[picked, :2]


def wanted(template):
    """Each line as a polyline of chords of 5 mm."""
    for segment in template.segments:
        if segment.line:
            yield np.array([segment.line.start, segment.line.end])
        else:
            start, center = np.array(segment.arc.start), np.array(segment.arc.center)
            reach = start - center
            count = math.ceil(math.hypot(*reach) * abs(segment.arc.sweep_angle) / 0.005)
            angle = np.linspace(0.0, segment.arc.sweep_angle, count + 1)[:, None]
            yield center + np.cos(angle) * reach + np.sin(angle) * np.array([-reach[1], reach[0]])


class Raster:
    """Cells around a template; which of them a brush drawn along polylines touches."""

    def __init__(self, polylines, width_m):
        points = np.concatenate(polylines)
        self.low = points.min(axis=0) - 0.5
        columns, rows = np.ceil((points.max(axis=0) + 0.5 - self.low) / CELL_M).astype(int)
        self.x = self.low[0] + CELL_M * (np.arange(columns) + 0.5)
        self.y = self.low[1] + CELL_M * (np.arange(rows) + 0.5)
        self.half_m = 0.5 * width_m

    def brushed(self, polylines):
        """Cells whose middle is within half a width of a polyline, square at its ends, round at its corners."""
        cells = np.zeros((len(self.y), len(self.x)), dtype=bool)
        for points in polylines:
            before, before_m = None, 0.0
            for a, b in pairwise(points):
                along = b - a
                length = math.hypot(*along)
                if length == 0.0:
                    continue
                low = np.minimum(a, b) - self.half_m - CELL_M - self.low
                high = np.maximum(a, b) + self.half_m + CELL_M - self.low
                (x0, y0), (x1, y1) = (low / CELL_M).astype(int), (high / CELL_M).astype(int)
                dx, dy = self.x[x0:x1] - a[0], (self.y[y0:y1] - a[1])[:, None]
                s = (dx * along[0] + dy * along[1]) / length
                left = (dy * along[0] - dx * along[1]) / length
                near = (s >= 0.0) & (s <= length) & (np.abs(left) <= self.half_m)
                if before is not None:  # the wedge on the outside of a corner
                    past = (dx * before[0] + dy * before[1]) / before_m >= 0.0
                    near |= past & (s < 0.0) & (s**2 + left**2 <= self.half_m**2)
                cells[y0:y1, x0:x1] |= near
                before, before_m = along, length
        return cells


def on_line(segment, points):
    """(arc length, distance to the left) of points against one line of the template, and its length."""
    if segment.line:
        start, end = np.array(segment.line.start), np.array(segment.line.end)
        length = math.dist(start, end)
        east, north = (end - start) / length
        off = points - start
        return off @ (east, north), off @ (-north, east), length
    start, center = np.array(segment.arc.start), np.array(segment.arc.center)
    radius, sweep = math.dist(start, center), segment.arc.sweep_angle
    side = math.copysign(1.0, sweep)
    off = points - center
    turned = side * (np.arctan2(off[:, 1], off[:, 0]) - math.atan2(*(start - center)[::-1]))
    middle = abs(sweep) / 2
    turned = middle + (turned - middle + np.pi) % (2 * np.pi) - np.pi
    return turned * radius, side * (radius - np.hypot(off[:, 0], off[:, 1])), radius * abs(sweep)


def length_within(template, strokes, limit_m):
    """Share of the lines, half a millimetre at a time, that the middle of paint passes within a distance of."""
    done = whole = 0
    for segment in template.segments:
        _, _, length = on_line(segment, np.zeros((1, 2)))
        marks = np.zeros(round(length / 0.0005), dtype=bool)
        for stroke in strokes:
            fine = np.concatenate([np.linspace(a, b, 20) for a, b in pairwise(stroke)])
            s, left, _ = on_line(segment, fine)
            for first, last, close in zip(
                s[:-1], s[1:], np.maximum(*np.abs((left[:-1], left[1:]))) <= limit_m, strict=True
            ):
                if close and abs(last - first) < 0.1:
                    low, high = sorted((first, last))
                    marks[max(0, math.ceil(low / 0.0005 - 0.5)) : max(0, math.ceil(high / 0.0005 - 0.5))] = True
        done, whole = done + marks.sum(), whole + len(marks)
    return done / whole


def lateral_errors(template, rows):
    """Distance from the nearest line that it follows, of the nozzle's last spraying millisecond in every tick."""
    spraying = np.flatnonzero(rows[:, 2] > 0.0)
    last = spraying[np.append(np.diff(spraying // STEPS) > 0, True)]
    ends, begins = rows[last, :2], rows[last - 1, :2]
    move = ends - begins
    best = np.full(len(last), np.inf)
    for segment in template.segments:
        s, left, length = on_line(segment, ends)
        before, *_ = on_line(segment, begins)
        follows = np.abs(s - before) >= math.cos(math.pi / 4) * np.hypot(*move.T)
        near = follows & (s >= -0.06) & (s <= length + 0.06) & (np.abs(left) < 0.5)
        best = np.where(near & (np.abs(left) < best), np.abs(left), best)
    return best[np.isfinite(best)]


@pytest.mark.parametrize("name", with_full("crossing", "corner", "circle", full=("line", "bend")))
def test_a_raster_of_the_true_nozzle_finds_the_same_coverage_overspray_and_lateral_error(name):
    width_m = 0.10 if name == "corner" else 0.12
    template = Template.model_validate({"name": name, "line_width_m": width_m, "segments": TEMPLATES[name]})
    emulator, rows = driven(template, seed=4)
    metrics = paint_metrics(emulator.work.ledger)
    strokes, lines = list(sprayed(rows)), list(wanted(template))
    bands = Raster([*lines, *strokes], width_m).brushed(lines)
    paint = Raster([*lines, *strokes], 0.12).brushed(strokes)
    found = {
        "length": 100 * length_within(template, strokes, width_m / 2),
        "area": 100 * (bands & paint).sum() / bands.sum(),
        "overspray": 100 * (paint & ~bands).sum() / bands.sum(),
    }
    said = {
        "length": metrics.coverage_pct,
        "area": metrics.area_coverage_pct,
        "overspray": 100 * metrics.overspray_m2 / (bands.sum() * CELL_M**2),
    }
    assert said == pytest.approx(found, abs=0.1)
    # Every place at which the error passes the limit is known to 5 mm, the length that is painted in a tick.
    within_pct = 100 * sum(emulator.work.ledger.within_by_target_m(0.005)) / template.length_m
    assert within_pct == pytest.approx(100 * length_within(template, strokes, 0.005), abs=0.3)
    errors = lateral_errors(template, rows)
    assert metrics.lateral.mean_m == pytest.approx(errors.mean(), rel=1e-3)
    assert metrics.lateral.p95_m == pytest.approx(np.quantile(errors, 0.95), rel=1e-3)
    assert metrics.lateral.max_m == pytest.approx(errors.max(), rel=1e-3)
