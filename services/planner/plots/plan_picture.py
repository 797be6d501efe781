"""Plot of a plan: lines to paint, paths of nozzle and robot along them, and transitions between them."""

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from touchline.core.robust_overlay import difference, union
from touchline.schemas.curves import Curve
from touchline.schemas.line_parts import part_of
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.coverage.swept_area import swept
from touchline.services.planner.geometry.clothoid import Floats, PiecePath
from touchline.services.planner.plan import Plan
from touchline.services.planner.plots.along import PAINTED_PT, QUANTITIES, TRANSITION_PT, draw_along
from touchline.services.planner.plots.ground import (
    BOUNDARY,
    COVERED,
    MISSED,
    fill_ground,
    fill_obstacles,
    outline_ground,
)
from touchline.services.planner.plots.style import INK, plan_style, save
from touchline.services.planner.segments.section import RUN_IN, RUN_OUT
from touchline.services.planner.swaths.offset import Stroke

if TYPE_CHECKING:
    from matplotlib.axes import Axes

STEP_M = 0.05
# Spacing of arrows along transitions (m), and length below which a transition has none.
ARROW_EVERY_M, ARROW_MIN_M = 12.0, 1.0
WIDTH_IN, HEIGHT_MAX_IN, MARGIN_SHARE, DPI = 11.0, 11.0, 0.03, 160
COLOUR_BAR_IN = 1.6

GRASS, PAINT = "#dfe9d8", "#ffffff"
NOZZLE, CENTRE, TRANSITION, RUN = "#1769aa", "#6b8fb3", "#d9480f", "#7b4fa3"


def plot_plan(
    plan: Plan, template: Template, path: Path | str, colour: str = "plain", vehicle: Vehicle | None = None
) -> None:
    """Draw `plan` of `template` to `path`, in the format of its suffix (.svg, .png, .pdf).

    `colour` is "plain" (one colour for lines, one for transitions), "speed" or "curvature" (the robot's path by its
    value, thick while painting); `vehicle` is the one that was planned for.

    Args:
        plan: Plan to draw.
        template: Template of the plan.
        path: File to write.
        colour: "plain", "speed" or "curvature".
        vehicle: Vehicle of the plan; None: the default one.

    Raises:
        ValueError: There is no such format.
        OSError: The file cannot be written.
    """
    from matplotlib.figure import Figure

    low, high = _bounds(plan)
    width, height = high - low
    drawn = WIDTH_IN if colour == "plain" else WIDTH_IN - COLOUR_BAR_IN
    size = (WIDTH_IN, min(max(drawn * height / width, 3.0) + 1.3, HEIGHT_MAX_IN))
    with plan_style():
        figure = Figure(figsize=size, layout="constrained")
        axes = figure.add_subplot()
        draw_plan(axes, plan, template, colour, vehicle or Vehicle())
        figure.legend(loc="outside lower center", ncols=4, frameon=False)
        save(figure, path, DPI)


def draw_plan(axes: "Axes", plan: Plan, template: Template, colour: str, vehicle: Vehicle) -> None:
    """Draw a plan into axes, whose scale is set; see `plot_plan`.

    Args:
        axes: Axes to draw into.
        plan: Plan to draw.
        template: Template of the plan.
        colour: "plain", "speed" or "curvature".
        vehicle: Vehicle of the plan.
    """
    low, high = _bounds(plan)
    axes.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x (m)", ylabel="y (m)")
    axes.set_facecolor(GRASS)
    axes.set_title(template.title or template.name, fontsize=14, fontweight="bold", color=INK, pad=20)
    axes.annotate(
        _figures(plan),
        xy=(0.5, 1.0),
        xycoords="axes fraction",
        xytext=(0.0, 5.0),
        textcoords="offset points",
        ha="center",
        va="bottom",
        color=INK,
    )
    if colour == "plain":
        _draw(axes, plan, template, vehicle)
    else:
        _draw_along(axes, plan, template, colour)


def _draw(axes: "Axes", plan: Plan, template: Template, vehicle: Vehicle) -> None:
    if plan.report.coverage and vehicle.tool.covers:
        _draw_covered(axes, plan, template, vehicle)
        return
    for section in plan.sections:
        centre = _path_points(section.path)
        if section.stroke is None:
            at_end = section.label in (RUN_IN, RUN_OUT)
            color, label = (RUN, "run-in and run-out") if at_end else (TRANSITION, "transition")
            _line(axes, centre, color, label, 1.0)
            _arrows(axes, centre, color)
            continue
        nozzle = _band(axes, section.stroke, template)
        _line(axes, nozzle, NOZZLE, "nozzle while painting", 1.3)
        _line(axes, centre, CENTRE, "robot while painting", 0.7, (0, (5, 3)))
        _arrow(axes, nozzle, NOZZLE)
    _left_out(axes, plan, template)
    _ends(axes, plan)


def _left_out(axes: "Axes", plan: Plan, template: Template) -> None:
    """Draw the stretches of lines that the plan leaves out, and the obstacles."""
    lines = {segment.id: segment.curve() for segment in template.segments}
    for each in plan.report.left_out:
        points = np.array(((each.from_x_m, each.to_x_m), (each.from_y_m, each.to_y_m)))
        if each.line_id in lines:
            points = _curve_points(part_of(lines[each.line_id], each.from_m, each.to_m))[0]
        _line(axes, points, MISSED, "left out", 2.0)
    fill_obstacles(axes, template)


def _draw_covered(axes: "Axes", plan: Plan, template: Template, vehicle: Vehicle) -> None:
    """Draw the covered and the missed ground, and the path over it, backward in a colour of its own."""
    import shapely

    area = union([each.polygon for each in template.areas])
    covered = swept([section.path for section in plan.sections], vehicle.tool.width_m)
    for ground, colour, name in (
        (covered, COVERED, "covered"),
        (difference(area, covered), MISSED, "missed"),
    ):
        fill_ground(axes, ground, colour, name)
        if not ground.is_empty:
            axes.plot([], [], "s", color=colour, label=name)
    fill_obstacles(axes, template)
    if template.boundary:
        outline_ground(axes, shapely.Polygon(template.boundary.corners), BOUNDARY, "--")
    for section in plan.sections:
        for piece, start in zip(section.path.pieces, section.path.knots, strict=False):
            color, label = (INK, "forward") if piece.direction > 0 else (RUN, "backward")
            _line(axes, _path_points(PiecePath(start, (piece,))), color, label, 0.9)
        if section.work_id:
            _arrows(axes, _path_points(section.path), INK)
    _ends(axes, plan)


def _draw_along(axes: "Axes", plan: Plan, template: Template, colour: str) -> None:
    for section in plan.sections:
        if section.stroke:
            _band(axes, section.stroke, template)
        else:
            _arrows(axes, _path_points(section.path), INK)
    _left_out(axes, plan, template)
    lines = draw_along(axes, plan, colour)
    for width, label in ((PAINTED_PT, "robot while painting"), (TRANSITION_PT, "robot between lines")):
        axes.plot([], [], color=INK, linewidth=width, label=label)
    label, marks = QUANTITIES[colour].label, QUANTITIES[colour].marks
    bar = axes.figure.colorbar(lines, ax=axes, label=label, shrink=0.6, pad=0.01)
    if marks is not None:
        bar.set_ticks(marks, labels=[f"{mark:g}" for mark in marks])
        bar.minorticks_off()
    _ends(axes, plan)


def _band(axes: "Axes", stroke: Stroke, template: Template) -> Floats:
    """Draw the painted line to scale; return the points (2, n) of its middle."""
    nozzle, normal = _curve_points(stroke.nozzle)
    left, right = (nozzle + side * 0.5 * template.line_width_m * normal for side in (1, -1))
    band = np.concatenate((left, right[:, ::-1]), axis=1)
    label = _once(axes, "template line, to scale")
    axes.fill(*band, facecolor=PAINT, edgecolor=INK, linewidth=0.15, zorder=2, label=label)
    return nozzle


def _ends(axes: "Axes", plan: Plan) -> None:
    start, stop = plan.sections[0].path.start, plan.sections[-1].path.end
    axes.plot(start.x_m, start.y_m, "o", color=INK, markersize=6, zorder=6, label="start")
    axes.plot(stop.x_m, stop.y_m, "s", color=INK, markersize=5, zorder=6, label="stop")


def _line(
    axes: "Axes",
    points: Floats,
    color: str,
    label: str,
    width: float,
    style: str | tuple[int, tuple[int, int]] = "-",
) -> None:
    label = _once(axes, label)
    axes.plot(*points, color=color, linewidth=width, linestyle=style, zorder=4, solid_capstyle="butt", label=label)


def _once(axes: "Axes", label: str) -> str:
    """Return the label, or a hidden one if the legend has it already."""
    return f"_{label}" if label in axes.get_legend_handles_labels()[1] else label


def _arrows(axes: "Axes", points: Floats, color: str) -> None:
    """Draw evenly spaced arrows along a transition."""
    length = STEP_M * points.shape[1]
    if length < ARROW_MIN_M:
        return
    for part in np.array_split(points, max(1, round(length / ARROW_EVERY_M)), axis=1):
        _arrow(axes, part, color)


def _arrow(axes: "Axes", points: Floats, color: str) -> None:
    """Draw one arrow half way along the points (2, n)."""
    middle = points.shape[1] // 2
    ahead = points[:, middle] - points[:, max(middle - 1, 0)]
    triangle = (3, 0, math.degrees(math.atan2(ahead[1], ahead[0])) - 90.0)
    axes.plot(*points[:, middle], marker=triangle, color=color, markersize=6, markeredgewidth=0.0, zorder=5)


def _path_points(path: PiecePath) -> Floats:
    x, y, _, _ = path.sample(_stations(path.length_m))
    return np.stack((x, y))


def _curve_points(curve: Curve) -> tuple[Floats, Floats]:
    """Points and left normals, (2, n) each."""
    straight = curve.curvature_1pm == 0.0
    x, y, heading, _ = curve.at(np.linspace(0.0, curve.length_m, 3) if straight else _stations(curve.length_m))
    return np.stack((x, y)), np.stack((-np.sin(heading), np.cos(heading)))


def _stations(length_m: float) -> Floats:
    return np.linspace(0.0, length_m, max(2, round(length_m / STEP_M)))


def _bounds(plan: Plan) -> tuple[Floats, Floats]:
    points = [_path_points(section.path) for section in plan.sections]
    points += [_curve_points(section.stroke.nozzle)[0] for section in plan.sections if section.stroke]
    everything = np.concatenate(points, axis=1)
    low, high = everything.min(axis=1), everything.max(axis=1)
    margin = MARGIN_SHARE * float((high - low).max())
    return low - margin, high + margin


def _figures(plan: Plan) -> str:
    report, share = plan.report, ""
    minutes, seconds = divmod(round(report.total_time_s), 60)
    if report.coverage:
        covered, whole = (sum(getattr(each, name) for each in report.coverage) for name in ("covered_m2", "area_m2"))
        share = f"{100.0 * covered / whole:.2f} % of the field  ·  "
    kind = "swath" if report.coverage else "line"
    lines, transitions = _counted(report.painted_segments, kind), _counted(report.transitions, "transition")
    return (
        f"{share}{lines} {report.paint_length_m:.1f} m  ·  {transitions} {report.transition_length_m:.1f} m  ·  "
        f"{minutes}:{seconds:02d} min"
    )


def _counted(count: int, name: str) -> str:
    return f"{count} {name}" if count == 1 else f"{count} {name}s"
