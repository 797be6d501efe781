"""Widget with the map of all robots, which stay in view until the operator moves the map."""

from __future__ import annotations

from textual import events

from touchline.tui.cells_view import ZOOM_STEP, CellsView
from touchline.tui.fleet_list import RobotPicked
from touchline.tui.fleet_raster import FleetRaster, FleetScene, fleet_scene, nearest
from touchline.tui.map_raster import Cells
from touchline.tui.robots import Robots

MARGIN = 0.12
"""Margin as a fraction of the view, so that driving robots do not make it jump at every step."""
SLACK = 2.0
"""Excess size from which a view is fitted again."""
LEAST_M = 4.0
_NAMES = 4


class FleetMap(CellsView):
    """Map with the marks of all robots and the plan of the picked one; a click picks the nearest."""

    def __init__(self) -> None:
        """Create an empty map."""
        super().__init__()
        self.border_title = "All robots"
        self._scene = FleetScene()
        self._raster = FleetRaster()
        self._fitted, self._follow, self._dragged = True, False, False

    def show(self, robots: Robots) -> None:
        """Redraw the map for the present states."""
        before, self._scene = self._scene, fleet_scene(robots)
        self._show_title()
        moved = self._move_view()
        if moved or self.cells is None or self._scene.key != before.key:
            self.redraw()

    def compose_cells(self) -> Cells:
        """Compose the fleet scene."""
        return self._raster.compose(self.view, self._scene)

    def _show_title(self) -> None:
        notes = ["All robots", *(["following " + self._scene.selected] if self._follow else [])]
        if far := self._scene.elsewhere:
            names = ", ".join(far[:_NAMES]) + (" …" if len(far) > _NAMES else "")
            notes.append(f"not on this map, as their origin is another one (≠): {names}")
        self.border_title = " · ".join(notes)

    def _move_view(self) -> bool:
        """Fit robots that left the view, or keep the picked one in the middle; true if the view changed."""
        before = self.view
        selected = next((robot for robot in self._scene.robots if robot.name == self._scene.selected), None)
        if self._follow and selected is not None:
            self.view = self.view.centered(selected.pose.x_m, selected.pose.y_m)
        elif self._fitted:
            self._fit()
        return self.view != before

    def _fit(self, *, anew: bool = False) -> None:
        """Show all robots; a view that shows them well is kept unless `anew`."""
        box = self._scene.bounds()
        if box is None:
            return
        middle = ((box[0] + box[2]) / 2, (box[1] + box[3]) / 2)
        half = (max(box[2] - box[0], LEAST_M) / 2, max(box[3] - box[1], LEAST_M) / 2)
        wide = (middle[0] - half[0], middle[1] - half[1], middle[0] + half[0], middle[1] + half[1])
        fitted = self.view.fitted(wide, MARGIN)
        inside = all(self.view.to_cell(x, y) is not None for x, y in (box[:2], box[2:]))
        if anew or not inside or self.view.dot_m > SLACK * fitted.dot_m:
            self.view = fitted

    def on_resize(self, event: events.Resize) -> None:
        """Keep the view, or all robots in it."""
        self.view = self.view.resized(self.size.width, self.size.height)
        if self._fitted:
            self._fit(anew=True)
        self.redraw()

    def fit(self) -> None:
        """Show all robots, and keep doing so."""
        self._fitted, self._follow = True, False
        self._fit(anew=True)
        self._show_title()
        self.redraw()

    def follow(self) -> None:
        """Toggle keeping the picked robot in the middle."""
        self._follow, self._fitted = not self._follow, False
        self._show_title()
        self._move_view()
        self.redraw()

    def zoom(self, steps: float, column: float | None = None, row: float | None = None) -> None:
        """Zoom, which ends fitting all robots."""
        self._fitted = False
        self.view = self.view.zoomed(ZOOM_STEP**steps, column, row)
        self._move_view()
        self.redraw()

    def on_mouse_down(self, event: events.MouseDown) -> None:
        """Begin to drag."""
        self._dragged = False
        self.capture_mouse()

    def on_mouse_move(self, event: events.MouseMove) -> None:
        """Drag the map."""
        if event.button and self.app.mouse_captured is self and (event.delta_x or event.delta_y):
            self._fitted = self._follow = False
            self._dragged = True
            self.view = self.view.panned(-event.delta_x, -event.delta_y)
            self._show_title()
            self.redraw()

    def on_mouse_up(self, event: events.MouseUp) -> None:
        """Pick the nearest robot, unless the map was dragged."""
        self.release_mouse()
        offset = event.get_content_offset(self)
        if self._dragged or offset is None:
            return
        name = nearest(self.view, self._scene, offset.x + 0.5, offset.y + 0.5)
        if name is not None:
            self.post_message(RobotPicked(name))
