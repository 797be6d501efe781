"""Widget of the field map: pan, zoom, follow, and redraw only of the rows that changed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from rich.markup import escape
from textual import events
from textual.binding import Binding, BindingType
from textual.message import Message

from touchline.schemas.messages.touchline import TraversalStatus
from touchline.schemas.plain_text import plain
from touchline.tui import theme
from touchline.tui.area_dots import AreaScene
from touchline.tui.cells_view import ZOOM_STEP, CellsView, cell_styles
from touchline.tui.goal_draft import GoalDraft
from touchline.tui.job import merge
from touchline.tui.map_raster import Cells, Ink, MapRaster, MapScene, NamedRobot
from touchline.tui.mono_cells import STYLES
from touchline.tui.raster import EMPTY
from touchline.tui.robot import ShownPose
from touchline.tui.robots import Robots
from touchline.tui.state import ConsoleState, missed_patches
from touchline.tui.viewport import Viewport, round_step_m

_ENDED = (TraversalStatus.DONE, TraversalStatus.ABORTED)
_STOPPED = (TraversalStatus.ESTOPPED, TraversalStatus.ABORTED)
PAN_CELLS = 6
FINE = 0.1
"""Factor on the step of a goal's motion with Shift."""
DRAG_CELLS = 1.5
"""Dragging distance (cells) up to which a goal's heading stays free."""

_UNHEARD = (f"{theme.BLACK} on {theme.MUTED}", "")
_STALE_COLORS = {
    Ink.SLOW_ZONE: (theme.MUTED, ""),
    Ink.STOP_ZONE: (theme.MUTED, ""),
    Ink.SEEN: (theme.MUTED, ""),
    Ink.OBSTACLE: _UNHEARD,
    Ink.ABSENT: _UNHEARD,
    Ink.BODY: (theme.MUTED, ""),
    Ink.NOZZLE_OFF: (theme.MUTED, ""),
    Ink.NOZZLE_ON: (theme.MUTED, ""),
    Ink.ROBOT: _UNHEARD,
    Ink.ROBOT_STOPPED: _UNHEARD,
}
"""Style of the last known position of a silent robot, and of what it saw."""


class GoalMoved(Message):
    """Message: the operator has moved the goal on the map."""


class MapView(CellsView, can_focus=True):
    """Map of the field with template, plan, paint, obstacles, zones, and robot."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding(shift + key, f"pan({columns}, {rows}, {bool(shift)})", "Pan", show=False)
        for shift in ("", "shift+")
        for key, columns, rows in (("up", 0, -1), ("down", 0, 1), ("left", -1, 0), ("right", 1, 0))
    ]

    def __init__(self) -> None:
        """Create an empty map."""
        super().__init__()
        self._title = self.border_title = "Field"
        self.follow = False
        self._fitted = True
        self._scene = MapScene()
        self._seen: tuple[object, object] = (None, None)
        self._draft = GoalDraft()
        self._pressed: ShownPose | None = None
        """Goal at the position where the pointer was pressed to aim."""
        self._raster = MapRaster()
        self._stale = False

    # -- what is drawn -----------------------------------------------------------------------------------------------

    def show(self, robots: Robots) -> None:
        """Redraw the map for the present states."""
        state = robots.selected
        self._show_stale(state.robot_stale)
        self._draft = state.drive
        before = self._scene
        self._scene = self._scene_of(state, robots.others)
        seen = (state.template, state.path)
        if seen[0] is not self._seen[0]:
            self._fitted = True
            self._title = _title(state)
            self._show_title()
        if self._fitted and (seen[0] is not self._seen[0] or seen[1] is not self._seen[1]):
            self.view = self._fit()
        self._seen = seen
        if self.follow and self._scene.robot:
            self.view = self.view.centered(self._scene.robot.x_m, self._scene.robot.y_m)
        if self._scene.key != before.key or self.cells is None or self.follow:
            self.redraw()

    def _show_stale(self, stale: bool) -> None:
        """Grey the robot while it is silent, and show a note."""
        if stale != self._stale:
            self._stale = stale
            self._show_title()
            shapes = STYLES if self.shapes else {}
            self.restyle(cell_styles({**shapes, **(_STALE_COLORS if stale else {})}))

    def _scene_of(self, state: ConsoleState, others: Mapping[str, ConsoleState]) -> MapScene:
        template, path, status = state.template, state.path, state.robot.status
        current, paints = EMPTY, False
        if state.busy and status:
            paints = bool(template and template.template.paints(status.segment_id))
            if template and status.segment_id in template.lines:
                current = template.lines[status.segment_id]
            elif path and status.segment_index < len(path.lines):
                current = path.lines[status.segment_index]
        area = _area_of(state)
        drawn, revision = template.line if template else EMPTY, id(template)
        if area is not None and path:  # the swaths are shown, too
            drawn, revision = merge([drawn, path.painting]), id(path)
        return MapScene(
            template=drawn,
            template_revision=revision,
            limits=template.limits if template else EMPTY,
            area=area,
            path=path.transitions if path else EMPTY,
            axle_path=path.painting if path else EMPTY,
            path_revision=id(path),
            current=current,
            current_paints=paints,
            current_revision=id(current),
            paint=state.paint.line,
            paint_revision=state.paint.revision,
            obstacles=state.obstacles,
            zones=state.zones,
            vehicle=state.vehicle,
            robot=state.robot.pose if state.robot_alive else None,
            spread=state.robot.spread,
            goal=_goal_of(state),
            preview=state.drive.path.transitions if state.drive.path else EMPTY,
            stopped=state.traversal in _STOPPED,
            spraying=bool(status and status.spraying),
            name="" if state.alone else state.name,
            others=tuple(
                NamedRobot(name, other.robot.pose, other.traversal in _STOPPED)
                for name, other in others.items()
                if other.robot_alive and other.robot.pose is not None
            ),
        )

    def compose_cells(self) -> Cells:
        """Compose the scene of the robot in view."""
        return self._raster.compose(self.view, self._scene)

    # -- where one looks ---------------------------------------------------------------------------------------------

    def _fit(self) -> Viewport:
        boxes = [line.bounds() for line in (self._scene.template, self._scene.path, self._scene.paint)]
        found = [box for box in boxes if box]
        found += [(pose.x_m, pose.y_m, pose.x_m, pose.y_m) for pose in (other.pose for other in self._scene.others)]
        if not found:
            x, y = (self._scene.robot.x_m, self._scene.robot.y_m) if self._scene.robot else (0.0, 0.0)
            return self.view.fitted((x - 10.0, y - 10.0, x + 10.0, y + 10.0))
        lows, highs = np.array(found)[:, :2].min(axis=0), np.array(found)[:, 2:].max(axis=0)
        return self.view.fitted((float(lows[0]), float(lows[1]), float(highs[0]), float(highs[1])))

    def _look(self, view: Viewport) -> None:
        self._fitted = False
        self.view = view
        self.redraw()

    def fit(self) -> None:
        """Show the whole job, and keep doing so when the terminal's size changes."""
        self.set_follow(False)
        self._fitted = True
        self.view = self._fit()
        self.redraw()

    def zoom(self, steps: float, column: float | None = None, row: float | None = None) -> None:
        """Zoom, which ends fitting the job."""
        if self.follow and self._scene.robot:
            view = self.view.zoomed(ZOOM_STEP**steps)
            self._look(view.centered(self._scene.robot.x_m, self._scene.robot.y_m))
        else:
            self._look(self.view.zoomed(ZOOM_STEP**steps, column, row))

    def set_follow(self, follow: bool) -> None:
        """Set whether the robot is kept in the middle."""
        self.follow = follow
        self._show_title()
        if follow and self._scene.robot:
            self._look(self.view.centered(self._scene.robot.x_m, self._scene.robot.y_m))

    def _show_title(self) -> None:
        notes = [self._title, *(["following the robot"] if self.follow else [])]
        self.border_title = " · ".join([*notes, *(["the robot where it was heard last"] if self._stale else [])])

    def action_pan(self, columns: int, rows: int, fine: bool) -> None:
        """Pan, which ends following; while the operator aims, move the goal."""
        if self._draft.goal is not None:
            self._draft.move(columns, -rows, round_step_m(self.view.cell_m) * (FINE if fine else 1.0))
            self.show_goal()
            return
        self.set_follow(False)
        self._look(self.view.panned(columns * PAN_CELLS, rows * PAN_CELLS / 2))

    def show_goal(self) -> None:
        """Bring the goal into view, and post that it has been moved."""
        goal = self._draft.goal
        if goal is not None and self.view.to_cell(goal.x_m, goal.y_m) is None:
            self.set_follow(False)
            self._look(self.view.centered(goal.x_m, goal.y_m))
        self.post_message(GoalMoved())

    def on_resize(self, event: events.Resize) -> None:
        """Keep the view, or the fit."""
        self.view = self.view.resized(self.size.width, self.size.height)
        if self._fitted:
            self.view = self._fit()
        self.redraw()

    def on_mouse_down(self, event: events.MouseDown) -> None:
        """Begin to drag: the field, or, while the operator aims, the goal's heading."""
        self.capture_mouse()
        offset = event.get_content_offset(self)
        if self._draft.goal is not None and offset is not None:
            x, y = self.view.to_field(offset.x + 0.5, offset.y + 0.5)
            step_m = round_step_m(self.view.cell_m) * FINE
            self._pressed = ShownPose(round(round(x / step_m) * step_m, 9), round(round(y / step_m) * step_m, 9), 0.0)
            self._point(event)

    def on_mouse_up(self, event: events.MouseUp) -> None:
        """Stop dragging."""
        self._pressed = None
        self.release_mouse()

    def on_mouse_move(self, event: events.MouseMove) -> None:
        """Drag the field, or show the coordinates under the pointer."""
        if self._pressed is not None:
            self._point(event)
            return
        if event.button and self.app.mouse_captured is self and (event.delta_x or event.delta_y):
            self.set_follow(False)
            self._look(self.view.panned(-event.delta_x, -event.delta_y))
            return
        offset = event.get_content_offset(self)
        if offset is not None:
            x, y = self.view.to_field(offset.x + 0.5, offset.y + 0.5)
            self.border_subtitle = f"{x:.1f}, {y:.1f} m"

    def _point(self, event: events.MouseEvent) -> None:
        """Turn the goal from where the pointer was pressed to where it is."""
        offset, pressed = event.get_content_offset(self), self._pressed
        if offset is None or pressed is None:
            return
        x, y = self.view.to_field(offset.x + 0.5, offset.y + 0.5)
        far = math.hypot(x - pressed.x_m, y - pressed.y_m) > DRAG_CELLS * self.view.cell_m
        degrees = round(math.degrees(math.atan2(y - pressed.y_m, x - pressed.x_m))) if far else math.nan
        self._draft.place(pressed.x_m, pressed.y_m, math.radians(degrees))
        self.show_goal()

    def on_leave(self) -> None:
        """Clear the coordinates."""
        self.border_subtitle = ""


def _goal_of(state: ConsoleState) -> ShownPose | None:
    """Goal that the operator aims at, or else that of the drive in view."""
    goal = state.drive.goal
    if goal is not None:
        return ShownPose(goal.x_m, goal.y_m, goal.heading_rad)
    return state.path.destination if state.path is not None and state.job.drives else None


def _area_of(state: ConsoleState) -> AreaScene | None:
    """Areas in view, if a covering tool works on them."""
    template, path, status = state.template, state.path, state.robot.status
    if template is None or not state.covers:
        return None
    at: int | None = status.segment_index if status and state.busy else 0
    if state.traversal in _ENDED and state.job is state.loaded:
        at = None
    return AreaScene(
        areas=template.template.areas,
        track=state.paint.line,
        track_revision=state.paint.revision,
        width_m=state.vehicle.tool.width_m,
        plan=path.lines if path else (),
        plan_revision=id(path),
        at=at,
        missed=tuple((patch.x_m, patch.y_m) for patch in missed_patches(state)),
    )


def _title(state: ConsoleState) -> str:
    template = state.template.template if state.template else None
    return escape(plain(template.title or template.name)) if template else "Field"
