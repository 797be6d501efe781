"""Plot of a drive to a goal over known ground: the path, and the body along it."""

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely

from touchline.schemas.known_ground import KnownGround
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import Plan
from touchline.services.planner.plots.ground import BOUNDARY, OBSTACLE, fill_ground, outline_ground
from touchline.services.planner.plots.style import INK, plan_style, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIZE_IN, DPI, STEP_M = 9.0, 160, 0.05
# Spacing of drawn bodies along the path, m and rad.
BODY_EVERY_M, BODY_EVERY_RAD = 0.5, 0.5
GRASS, PATH, BODY = "#dfe9d8", "#d9480f", "#1769aa"


def plot_way(plan: Plan, ground: KnownGround, vehicle: Vehicle, path: Path | str) -> None:
    """Draw a drive to a goal to a file, in the format of its suffix (.svg, .png, .pdf).

    Args:
        plan: The drive.
        ground: Known ground.
        vehicle: Vehicle of the plan.
        path: File to write.

    Raises:
        ValueError: There is no such format.
        OSError: The file cannot be written.
    """
    from matplotlib.figure import Figure

    with plan_style():
        figure = Figure(figsize=(SIZE_IN, SIZE_IN), layout="constrained")
        axes = figure.add_subplot()
        axes.set(aspect="equal", xlabel="x (m)", ylabel="y (m)")
        axes.set_title(f"{plan.report.total_length_m:.2f} m, {plan.report.total_time_s:.1f} s", color=INK)
        _draw(axes, plan, ground, vehicle)
        save(figure, path, DPI)


def _draw(axes: "Axes", plan: Plan, ground: KnownGround, vehicle: Vehicle) -> None:
    obstacles = shapely.union_all([shapely.Polygon(each.corners, each.holes) for each in ground.obstacles])
    if ground.boundary:
        boundary = shapely.Polygon(ground.boundary)
        outline_ground(axes, boundary, BOUNDARY, "solid")
        fill_ground(axes, boundary, GRASS, "ground")
    fill_ground(axes, obstacles, OBSTACLE, "obstacles")
    for section in plan.sections:
        driven = section.path
        along = np.linspace(0.0, driven.length_m, 2 + math.ceil(driven.length_m / STEP_M))
        axes.plot(*driven.sample(along)[:2], color=PATH, linewidth=1.2)
        stations = np.append(np.arange(0.0, driven.length_m, BODY_EVERY_M), driven.length_m)
        poses = np.concatenate((np.column_stack(driven.sample(stations)[:3]), driven.spun(BODY_EVERY_RAD)))
        for x, y, heading in poses:
            cos, sin = math.cos(heading), math.sin(heading)
            corners = np.array(vehicle.body.footprint_m) @ np.array([[cos, sin], [-sin, cos]]) + (x, y)
            axes.fill(*corners.T, facecolor="none", edgecolor=BODY, linewidth=0.4)
