"""Raster of the fleet map: team layer, the plan of one robot, marks, and names.

With less room, less is drawn: bodies become arrows, arrows that share a cell become their number, and names yield to
everything else, those of robots that need an operator last.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from touchline.schemas.messages.touchline import TraversalStatus
from touchline.schemas.vehicles import Vehicle
from touchline.tui.fleet_layer import NO_LAYER, FleetLayer, Line
from touchline.tui.fleet_rows import elsewhere
from touchline.tui.map_raster import (
    Cells,
    Ink,
    arrow,
    body_outline,
    draw_grid,
    draw_scale,
    edge_mark,
    grid_step_m,
    overlay,
    put,
    put_name,
    stripes,
)
from touchline.tui.raster import BRAILLE_BASE, EMPTY, GrowingLayer, Polyline, dashed
from touchline.tui.robot import ShownPose
from touchline.tui.robots import Robots
from touchline.tui.state import ConsoleState
from touchline.tui.viewport import Viewport

BODY_CELLS = 2.0
"""Length from which a body is drawn."""
DASH_DOTS = 3
MANY = "+"
"""Mark of more robots in a cell than a digit can count."""
GOAL = "×"
SILENT = "?"
GONE = "✗"
_STOPPED = (TraversalStatus.ESTOPPED, TraversalStatus.ABORTED)
_URGENCY = (Ink.OTHER, Ink.OTHER_STOPPED, Ink.GONE, Ink.UNHEARD, Ink.ROBOT, Ink.ROBOT_STOPPED)
"""Inks by urgency: robots that share a cell get the last of theirs."""


@dataclass(frozen=True)
class MappedRobot:
    """Robot as drawn: `mark` is its arrow, or a replacement."""

    name: str
    pose: ShownPose
    mark: str
    ink: Ink
    vehicle: Vehicle


@dataclass(frozen=True, eq=False)
class FleetScene:
    """Content of the map; `elsewhere` are robots in a frame with another origin."""

    robots: tuple[MappedRobot, ...] = ()
    selected: str = ""
    elsewhere: tuple[str, ...] = ()
    lines: Polyline = EMPTY
    path: Polyline = EMPTY
    plan_revision: tuple[int, int] = (0, 0)
    layer: FleetLayer = NO_LAYER

    @property
    def key(self) -> tuple[object, ...]:
        """Key that is equal for scenes that look the same."""
        looks = tuple((robot.name, robot.pose, robot.mark, robot.ink, id(robot.vehicle)) for robot in self.robots)
        return looks, self.selected, self.plan_revision, id(self.layer)

    def bounds(self) -> tuple[float, float, float, float] | None:
        """Bounds (x_min, y_min, x_max, y_max) in metres of robots, cells, goals and claims; None without any."""
        points = [(robot.pose.x_m, robot.pose.y_m) for robot in self.robots]
        points += [goal for goal in self.layer.goals.values() if all(map(math.isfinite, goal))]
        boxes = [box for line in (self.layer.outlines(), self.layer.claimed()) if (box := line.bounds())]
        points += [corner for box in boxes for corner in (box[:2], box[2:])]
        if not points:
            return None
        low, high = np.min(points, axis=0), np.max(points, axis=0)
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def fleet_scene(robots: Robots) -> FleetScene:
    """Create the scene of all robots with a known last position, on the map of the one in view."""
    here = robots.selected
    mapped, far = list[MappedRobot](), list[str]()
    for name, state in robots.states.items():
        if elsewhere(state, here):
            far.append(name)
        elif (shown := _mapped(name, state, selected=state is here)) is not None:
            mapped.append(shown)
    template, path = here.template, here.path
    return FleetScene(
        tuple(mapped),
        robots.selected_name,
        tuple(far),
        template.line if template else EMPTY,
        path.transitions if path else EMPTY,
        (id(template), id(path)),
        robots.layer,
    )


def claims_of(robots: Robots) -> Mapping[str, Line]:
    """Claimed stretches of robots of shared jobs, on the map of the one in view."""
    reported = ((name, state, state.claimed) for name, state in robots.states.items())
    return {name: line for name, state, line in reported if line is not None and not elsewhere(state, robots.selected)}


def _mapped(name: str, state: ConsoleState, *, selected: bool) -> MappedRobot | None:
    pose = state.robot.pose or state.last_pose
    if pose is None:
        return None
    stopped = state.traversal in _STOPPED
    mark, ink = arrow(pose.heading_rad), Ink.OTHER_STOPPED if stopped else Ink.OTHER
    if selected:
        ink = Ink.ROBOT_STOPPED if stopped else Ink.ROBOT
    if not state.robot_alive:
        mark, ink = GONE, Ink.GONE
    elif state.robot_stale or state.robot.pose is None:
        mark, ink = SILENT, Ink.UNHEARD
    return MappedRobot(name, pose, mark, ink, state.vehicle)


class FleetRaster:
    """Renderer of scenes; caches the layers that stay the same while robots move."""

    def __init__(self) -> None:
        """Create empty layers."""
        self._grid, self._lines, self._path = GrowingLayer(), GrowingLayer(), GrowingLayer()
        self._shared, self._own = GrowingLayer(), GrowingLayer()
        self._claims, self._own_claim = GrowingLayer(), GrowingLayer()

    def compose(self, view: Viewport, scene: FleetScene) -> Cells:
        """Draw a scene."""
        bits = np.zeros((view.rows, view.columns), dtype=np.uint8)
        inks = np.full(bits.shape, Ink.GROUND, dtype=np.uint8)
        layer, selected = scene.layer, scene.selected
        own = hash((id(layer), selected))
        dash_m = DASH_DOTS * view.dot_m
        self._lines.update(view, scene.lines, scene.plan_revision[0])
        self._path.update(view, scene.path, scene.plan_revision[1])
        self._claims.update(view, dashed(layer.claimed(besides=selected), dash_m), own)
        self._own_claim.update(view, dashed(layer.claimed(of=selected), dash_m), own)
        self._shared.update(view, layer.outlines(besides=selected), own)
        self._own.update(view, layer.outlines(of=selected), own)
        for drawn, ink in (
            (self._path, Ink.PATH),
            (self._lines, Ink.TEMPLATE),
            (self._claims, Ink.CURRENT_PATH),
            (self._own_claim, Ink.CURRENT),
            (self._shared, Ink.LIMIT),
            (self._own, Ink.CURRENT),
        ):
            here = drawn.bits > 0
            bits[here] |= drawn.bits[here]
            inks[here] = ink
        step = grid_step_m(view)
        draw_grid(view, step, self._grid, bits, inks)
        cells = Cells(bits.astype(np.uint32) + np.uint32(BRAILLE_BASE), inks, stripes(view, step))
        draw_scale(view, cells)
        _draw_bodies(view, scene, bits, cells)
        _draw_goals(view, scene, cells)
        _draw_marks(view, scene, cells)
        return cells


def _draw_bodies(view: Viewport, scene: FleetScene, bits: np.ndarray, cells: Cells) -> None:
    for robot in scene.robots:
        corners = np.asarray(robot.vehicle.body.footprint_m)
        if float(np.ptp(corners[:, 0])) < BODY_CELLS * view.cell_m:
            continue
        cos, sin = math.cos(robot.pose.heading_rad), math.sin(robot.pose.heading_rad)
        ink = Ink.BODY if robot.name == scene.selected else Ink.LABEL
        overlay(view, body_outline(robot.vehicle, robot.pose, cos, sin), ink, bits, cells)


def _draw_goals(view: Viewport, scene: FleetScene, cells: Cells) -> None:
    for name, (x_m, y_m) in scene.layer.goals.items():
        at = view.to_cell(x_m, y_m)
        if at is not None:
            put(cells, at, GOAL, Ink.GOAL if name == scene.selected else Ink.LABEL)


def _draw_marks(view: Viewport, scene: FleetScene, cells: Cells) -> None:
    """Draw a mark in each cell with robots; an edge mark points to the selected one if it is out of view."""
    names: list[tuple[tuple[bool, int], tuple[int, int], str]] = []
    for at, there in _by_cell(view, scene).items():
        top = max(there, key=lambda robot: (_is(robot, scene), _URGENCY.index(robot.ink)))
        others, selected = len(there) - 1, _is(top, scene)
        crowd = str(len(there)) if len(there) < 10 else MANY
        put(cells, at, top.mark if selected or not others else crowd, top.ink)
        if selected or not others:
            rank = (not selected, -_URGENCY.index(top.ink))
            names.append((rank, at, f"{top.name} +{others}" if others else top.name))
    for _, at, name in sorted(names):
        put_name(cells, at, name)
    for robot in scene.robots:
        if _is(robot, scene) and view.to_cell(robot.pose.x_m, robot.pose.y_m) is None:
            put(cells, *edge_mark(view, robot.pose), robot.ink)


def _is(robot: MappedRobot, scene: FleetScene) -> bool:
    return robot.name == scene.selected


def _by_cell(view: Viewport, scene: FleetScene) -> Mapping[tuple[int, int], list[MappedRobot]]:
    found: defaultdict[tuple[int, int], list[MappedRobot]] = defaultdict(list)
    for robot in scene.robots:
        at = view.to_cell(robot.pose.x_m, robot.pose.y_m)
        if at is not None:
            found[at].append(robot)
    return found


def nearest(view: Viewport, scene: FleetScene, column: float, row: float) -> str | None:
    """Name of the robot nearest to a screen position, within two cells."""
    x_m, y_m = view.to_field(column, row)
    found = [(math.hypot(robot.pose.x_m - x_m, robot.pose.y_m - y_m), robot.name) for robot in scene.robots]
    distance_m, name = min(found, default=(math.inf, ""))
    return name if distance_m <= 2.5 * view.cell_m else None
