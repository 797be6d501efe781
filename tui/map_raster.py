"""Raster of the field map, as arrays of characters and inks: braille layers, then marks and text."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.vehicles import Vehicle
from touchline.tui import format
from touchline.tui.area_dots import AreaScene
from touchline.tui.area_layer import AreaLayer
from touchline.tui.obstacle_view import ObstacleView
from touchline.tui.raster import BRAILLE_BASE, EMPTY, GrowingLayer, Polyline, dashed, draw
from touchline.tui.robot import ShownPose
from touchline.tui.spread import Spread
from touchline.tui.viewport import DOTS_Y, Viewport
from touchline.tui.zone_outlines import NO_ZONES, ZoneOutlines

ARROWS = "→↗↑↖←↙↓↘"
ANY_HEADING = "✕"
OFF_VIEW = "▷◥△◤◁◣▽◢"
AXLE_PATH_DOT_M = 0.1
"""Scale from which the axle's path beside a painted line is shown."""
BODY_DOT_M = 0.1
"""Scale from which the robot has a shape."""
ZONE_DOT_M = 0.25
"""Scale from which the zones of its protection are shown."""
DASH_DOTS = 3
"""Length of dashes and gaps of a previewed path, and of the zone in which a thing slows the robot down."""
GRID_MIN_CELLS = 7
HEADING_CELLS = 4.0
"""Length of the line that shows a goal's heading."""
PAINT_BESIDE_DOTS = 1
SHOWN_FIRST_DOTS = 2
"""Dots of eight on the swath ahead from which a cell shows nothing else."""
MISSED_MARK = "×"
"""Mark of cells with any missed ground, visible at every scale and without colours."""

Bits = NDArray[np.uint8]


class Ink(IntEnum):
    """Content of a cell; a higher one hides a lower one in the same cell."""

    GROUND = 0
    GRID = 1
    PATH = 2
    CURRENT_PATH = 3
    TEMPLATE = 4
    CURRENT = 5
    LIMIT = 6
    PAINT = 7
    MISSED = 8
    SLOW_ZONE = 9
    """Outline in which a thing slows the robot down."""
    STOP_ZONE = 10
    """Outline in which a thing stops the robot."""
    SEEN = 11
    """Outline of an obstacle that the plan does not know."""
    BODY = 12
    LABEL = 13
    OBSTACLE = 14
    """Kind of an obstacle that the plan does not know, and the direction of its motion."""
    ABSENT = 15
    """Place of an obstacle of the plan that is missing."""
    OTHER = 16
    OTHER_STOPPED = 17
    NOZZLE_OFF = 18
    NOZZLE_ON = 19
    GOAL = 20
    ROBOT = 21
    ROBOT_STOPPED = 22
    UNHEARD = 23
    """Last known position of a silent robot."""
    GONE = 24


@dataclass(frozen=True)
class NamedRobot:
    """One robot of several: name, pose, and whether it is stopped."""

    name: str
    pose: ShownPose
    stopped: bool


@dataclass(frozen=True, eq=False)
class MapScene:
    """Content of the map. A line with the same revision has only grown since."""

    template: Polyline = EMPTY
    template_revision: int = 0
    path: Polyline = EMPTY
    axle_path: Polyline = EMPTY
    path_revision: int = 0
    current: Polyline = EMPTY
    current_paints: bool = False
    current_revision: int = 0
    paint: Polyline = EMPTY
    paint_revision: int = 0
    limits: Polyline = EMPTY
    """Boundary and obstacles of the template."""
    area: AreaScene | None = None
    """Areas of a covering tool, whose strokes are then shown as a band."""
    obstacles: tuple[ObstacleView, ...] = ()
    """Obstacles that the robot sees."""
    zones: ZoneOutlines = NO_ZONES
    """Zones of its protection."""
    vehicle: Vehicle = field(default_factory=Vehicle)
    robot: ShownPose | None = None
    spread: Spread | None = None
    """Uncertainty of the robot's position."""
    goal: ShownPose | None = None
    """Goal of a drive or draft; heading NaN: any."""
    preview: Polyline = EMPTY
    """Planned path to the goal, not driven yet."""
    stopped: bool = False
    spraying: bool = False
    name: str = ""
    """Name of the robot; "" if there is no other."""
    others: tuple[NamedRobot, ...] = ()

    @property
    def key(self) -> tuple[object, ...]:
        """Key that is equal for scenes that look the same."""
        revisions = (self.template_revision, self.path_revision, self.current_revision, self.paint_revision)
        robots = (self.robot, self.spread, self.stopped, self.spraying, self.name, self.others)
        area = self.area.key if self.area is not None else ()
        goal = (self.goal, id(self.preview))
        seen = (id(self.obstacles), id(self.zones))
        return (*revisions, len(self.paint), len(self.limits), *area, id(self.vehicle), *robots, *goal, *seen)


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells of the map: code points and inks (rows, columns); `stripe` marks odd stripes of turf."""

    codes: NDArray[np.uint32]
    inks: NDArray[np.uint8]
    stripe: NDArray[np.bool_]


class MapRaster:
    """Renderer of scenes with cached layers, cheap for scenes that only grew or in which only the robot moved."""

    def __init__(self) -> None:
        """Create empty layers."""
        self._grid = GrowingLayer()
        self._path, self._axle_path = GrowingLayer(), GrowingLayer()
        self._template, self._current, self._paint = GrowingLayer(), GrowingLayer(), GrowingLayer()
        self._limits, self._area = GrowingLayer(), AreaLayer()

    def compose(self, view: Viewport, scene: MapScene) -> Cells:
        """Draw a scene."""
        self._path.update(view, scene.path, scene.path_revision)
        axle_path = scene.axle_path if view.dot_m <= AXLE_PATH_DOT_M else EMPTY
        self._axle_path.update(view, axle_path, scene.path_revision)
        self._template.update(view, scene.template, scene.template_revision)
        self._current.update(view, scene.current, scene.current_revision)
        self._paint.update(view, scene.paint, scene.paint_revision)
        self._limits.update(view, scene.limits, scene.template_revision)
        paint, missed = self._paint.bits, np.zeros_like(self._paint.bits)
        if scene.area is not None:
            paint, missed = self._area.update(view, scene.area)

        driven = self._path.bits | self._axle_path.bits
        current = self._current.bits if scene.current_paints else np.zeros_like(driven)
        bits = self._template.bits | current | paint
        inks = line_inks(self._template.bits, current, paint)
        limited = (self._limits.bits > 0) & ((bits == 0) | (inks == Ink.TEMPLATE))
        bits[limited] |= self._limits.bits[limited]
        inks[limited] = Ink.LIMIT
        if scene.area is not None:
            _put_first(bits, inks, current & ~paint, Ink.CURRENT)
            bits[missed > 0], inks[missed > 0] = missed[missed > 0], Ink.MISSED
        if not scene.current_paints:
            driven |= self._current.bits
        free = bits == 0
        bits[free] = driven[free]
        inks[free & (driven > 0)] = Ink.PATH
        if not scene.current_paints:
            inks[free & (self._current.bits > 0)] = Ink.CURRENT_PATH

        step = grid_step_m(view)
        draw_grid(view, step, self._grid, bits, inks)
        codes = bits.astype(np.uint32) + np.uint32(BRAILLE_BASE)
        codes[inks == Ink.MISSED] = ord(MISSED_MARK)
        cells = Cells(codes, inks, stripes(view, step))
        overlay(view, dashed(scene.preview, DASH_DOTS * view.dot_m), Ink.CURRENT_PATH, bits, cells)
        if view.dot_m <= ZONE_DOT_M:
            overlay(view, dashed(scene.zones.slow, DASH_DOTS * view.dot_m), Ink.SLOW_ZONE, bits, cells)
            overlay(view, scene.zones.stop, Ink.STOP_ZONE, bits, cells)
        _draw_obstacles(view, scene.obstacles, bits, cells)
        if scene.robot and scene.spread and 2 * scene.spread.long_m > view.cell_m:
            overlay(view, scene.spread.outline(scene.robot.x_m, scene.robot.y_m), Ink.BODY, bits, cells)
        _draw_others(view, scene.others, cells)
        if scene.goal:
            _draw_goal(view, scene.goal, bits, cells)
        if scene.robot:
            self._draw_robot(view, scene, scene.robot, bits, cells)
        draw_scale(view, cells)
        return cells

    def _draw_robot(self, view: Viewport, scene: MapScene, pose: ShownPose, bits: Bits, cells: Cells) -> None:
        cos, sin = math.cos(pose.heading_rad), math.sin(pose.heading_rad)
        ink = Ink.ROBOT_STOPPED if scene.stopped else Ink.ROBOT
        if view.dot_m <= BODY_DOT_M:
            overlay(view, body_outline(scene.vehicle, pose, cos, sin), Ink.BODY, bits, cells)
        x, y = scene.vehicle.tool.point_m
        nozzle = view.to_cell(pose.x_m + cos * x - sin * y, pose.y_m + sin * x + cos * y)
        center = view.to_cell(pose.x_m, pose.y_m)
        if nozzle:
            put(cells, nozzle, "●" if scene.spraying else "○", Ink.NOZZLE_ON if scene.spraying else Ink.NOZZLE_OFF)
        if center:
            put(cells, center, arrow(pose.heading_rad), ink)
            put_name(cells, center, scene.name)
        else:
            put(cells, *edge_mark(view, pose), ink)


def _put_first(bits: Bits, inks: Bits, dots: Bits, ink: Ink) -> None:
    """Show only these dots in cells with a few of them, as they would be invisible beside a covered band."""
    cells = np.bitwise_count(dots) >= SHOWN_FIRST_DOTS
    bits[cells], inks[cells] = dots[cells], ink


def _draw_obstacles(view: Viewport, obstacles: tuple[ObstacleView, ...], bits: Bits, cells: Cells) -> None:
    """Draw outlines, then marks of kinds, each with an arrow beside it in the direction of its motion."""
    for seen in obstacles:
        overlay(view, seen.outline, Ink.SEEN, bits, cells)
    for seen in obstacles:
        center = view.to_cell(seen.x_m, seen.y_m)
        if center is None:
            continue
        put(cells, center, seen.mark, Ink.ABSENT if seen.absent else Ink.OBSTACLE)
        if seen.motion_rad is not None:
            column, row = center[0] + round(math.cos(seen.motion_rad)), center[1] - round(math.sin(seen.motion_rad))
            if 0 <= column < view.columns and 0 <= row < view.rows:
                put(cells, (column, row), arrow(seen.motion_rad), Ink.OBSTACLE)


def _draw_others(view: Viewport, others: tuple[NamedRobot, ...], cells: Cells) -> None:
    """Draw the other robots: arrows if they are in view, and names if there is room."""
    centers = [(other, view.to_cell(other.pose.x_m, other.pose.y_m)) for other in others]
    for other, center in centers:
        if center:
            ink = Ink.OTHER_STOPPED if other.stopped else Ink.OTHER
            put(cells, center, arrow(other.pose.heading_rad), ink)
    for other, center in centers:
        if center:
            put_name(cells, center, other.name)


def put_name(cells: Cells, at: tuple[int, int], name: str) -> None:
    """Write a name beside an arrow, on the right or else on the left, but not over another name or arrow."""
    column, row = at
    for first in (column + 2, column - 1 - len(name)):
        here = slice(first, first + len(name))
        if 0 <= first <= cells.codes.shape[1] - len(name) and (cells.inks[row, here] < Ink.LABEL).all():
            cells.codes[row, here] = np.frombuffer(name.encode("utf-32-le"), dtype="<u4")
            cells.inks[row, here] = Ink.LABEL
            return


def arrow(heading_rad: float) -> str:
    """Arrow nearest to a heading."""
    return ARROWS[round(heading_rad / (math.pi / 4)) % 8]


def overlay(view: Viewport, line: Polyline, ink: Ink, bits: Bits, cells: Cells) -> None:
    """Draw a line over other layers: its cells keep their dots, and take its colour."""
    dots = np.zeros_like(bits)
    draw(dots, view, line)
    here = dots > 0
    bits[here] |= dots[here]
    cells.codes[here] = bits[here].astype(np.uint32) + np.uint32(BRAILLE_BASE)
    cells.inks[here] = ink


def _draw_goal(view: Viewport, goal: ShownPose, bits: Bits, cells: Cells) -> None:
    """Draw a mark, and a line in the direction of the heading unless it is free."""
    free = math.isnan(goal.heading_rad)
    if not free:
        length_m = HEADING_CELLS * view.cell_m
        x = np.array([goal.x_m, goal.x_m + length_m * math.cos(goal.heading_rad)])
        y = np.array([goal.y_m, goal.y_m + length_m * math.sin(goal.heading_rad)])
        overlay(view, Polyline(x, y, np.array([False, True])), Ink.CURRENT_PATH, bits, cells)
    at = view.to_cell(goal.x_m, goal.y_m)
    if at is not None:
        put(cells, at, ANY_HEADING if free else arrow(goal.heading_rad), Ink.GOAL)


def line_inks(template: Bits, current: Bits, paint: Bits) -> Bits:
    """Ink of each cell (rows, columns) from its dots of the template, the current line, and paint.

    A cell has the colour of most of its dots. Paint lies up to a dot beside its line, so that a cell with at most one
    unpainted dot more than painted ones counts as painted.
    """
    painted = np.bitwise_count(paint)
    being_painted = np.bitwise_count(current & ~paint)
    to_paint = np.bitwise_count(template & ~current & ~paint)
    inks = np.where(template > 0, np.uint8(Ink.TEMPLATE), np.uint8(Ink.GROUND))
    inks[(current > 0) & (being_painted >= to_paint)] = Ink.CURRENT
    inks[(paint > 0) & (being_painted + to_paint <= painted + PAINT_BESIDE_DOTS)] = Ink.PAINT
    return inks


def grid_step_m(view: Viewport) -> float:
    """Distance of grid points: 1, 2 or 5 times a power of ten metres, several cells apart."""
    least = view.cell_m * GRID_MIN_CELLS
    power = 10.0 ** math.floor(math.log10(least))
    return next(power * factor for factor in (1, 2, 5, 10) if power * factor >= least * (1 - 1e-9))


def draw_grid(view: Viewport, step_m: float, layer: GrowingLayer, bits: Bits, inks: Bits) -> None:
    """Draw dots in the corners of the grid, where there is nothing else; `layer` caches them."""
    x_min, y_max = view.to_field(0, 0)
    x_max, y_min = view.to_field(view.columns, view.rows)
    xs = np.arange(math.ceil(x_min / step_m), math.floor(x_max / step_m) + 1) * step_m
    ys = np.arange(math.ceil(y_min / step_m), math.floor(y_max / step_m) + 1) * step_m
    x, y = (axis.ravel().astype(np.float64) for axis in np.meshgrid(xs, ys))
    layer.update(view, Polyline(x, y, np.zeros(len(x), dtype=np.bool_)), 0)
    free = (bits == 0) & (layer.bits > 0)
    bits[free] = layer.bits[free]
    inks[free] = Ink.GRID


def stripes(view: Viewport, step_m: float) -> NDArray[np.bool_]:
    """Flags (columns,) of columns in odd stripes of the turf, which are a grid step wide."""
    x = view.center_x_m + (np.arange(view.columns) + 0.5 - view.columns / 2) * view.cell_m
    odd: NDArray[np.bool_] = np.floor(x / step_m).astype(np.int64) % 2 == 1
    return odd


def draw_scale(view: Viewport, cells: Cells) -> None:
    """Draw a scale bar in the lower left corner, one grid step long if that fits, with its length."""
    step = grid_step_m(view)
    width = round(step / view.cell_m)
    text = f" {format.round_length(step)} "
    if view.rows < 4 or width + len(text) + 3 > view.columns:
        return
    bar = "├" + "─" * max(width - 2, 0) + "┤"
    for offset, character in enumerate(bar + text):
        put(cells, (1 + offset, view.rows - 1), character, Ink.LABEL)


def put(cells: Cells, at: tuple[int, int], character: str, ink: Ink) -> None:
    """Write a character to the cell at (column, row)."""
    column, row = at
    cells.codes[row, column] = ord(character)
    cells.inks[row, column] = ink


def body_outline(vehicle: Vehicle, pose: ShownPose, cos: float, sin: float) -> Polyline:
    """Outline of the body at a pose."""
    x, y = np.array([*vehicle.body.footprint_m, vehicle.body.footprint_m[0]]).T
    return Polyline(pose.x_m + cos * x - sin * y, pose.y_m + sin * x + cos * y, np.arange(len(x)) > 0)


def edge_mark(view: Viewport, pose: ShownPose) -> tuple[tuple[int, int], str]:
    """Border cell nearest to a robot out of view, and a mark that points to it."""
    x, y = np.array([pose.x_m]), np.array([pose.y_m])
    u, v = (float(axis[0]) for axis in view.to_dots(x, y))
    column = int(min(max(u / 2, 0), view.columns - 1))
    row = int(min(max(v / DOTS_Y, 0), view.rows - 1))
    octant = round(math.atan2(view.height / 2 - v, u - view.width / 2) / (math.pi / 4)) % 8
    return (column, row), OFF_VIEW[octant]
