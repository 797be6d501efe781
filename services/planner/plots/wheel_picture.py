"""A plan's wheels over time: speed and acceleration of both, with their limits, and when paint flows."""

from pathlib import Path
from typing import TYPE_CHECKING

from touchline.schemas.template import Template
from touchline.schemas.vehicle import Vehicle
from touchline.services.planner.plan import Plan
from touchline.services.planner.plots.style import INK, plan_style, save
from touchline.services.planner.plots.wheel_series import wheel_series

if TYPE_CHECKING:
    from matplotlib.axes import Axes

STEP_M = 0.02
LEFT, RIGHT, LIMIT, PAINTING = "#1769aa", "#d9480f", "#8a8f98", "#dfe9d8"
DPI = 160


def plot_wheels(plan: Plan, template: Template, vehicle: Vehicle, path: Path | str) -> None:
    """Draw the wheels of `plan` to `path`; the ending (.svg, .png, .pdf) says how.

    Raises:
        ValueError: There is no such format.
        OSError: The file cannot be written.
    """
    from matplotlib.figure import Figure

    series = wheel_series(plan, vehicle, STEP_M)
    with plan_style():
        figure = Figure(figsize=(11.0, 6.0), layout="constrained")
        speed, acceleration = figure.subplots(2, 1, sharex=True)
        for axes, values, limit, text in (
            (speed, series.wheel_radps, vehicle.max_wheel_speed_radps, "wheel speed (rad/s)"),
            (acceleration, series.wheel_radps2, vehicle.max_wheel_acceleration_radps2, "wheel acceleration (rad/s²)"),
        ):
            _shade(axes, plan)
            axes.plot(series.time_s, values[0], color=LEFT, linewidth=0.9, label="left wheel")
            axes.plot(series.time_s, values[1], color=RIGHT, linewidth=0.9, label="right wheel")
            lowest = -limit if values.min() < 0.0 else 0.0
            for level in {limit, lowest} - {0.0}:
                axes.axhline(level, color=LIMIT, linewidth=1.0, linestyle=(0, (4, 3)))
            axes.plot([], [], color=LIMIT, linewidth=1.0, linestyle=(0, (4, 3)), label="limit")
            axes.set(ylabel=text, xlim=(0.0, plan.speeds.total_time_s), ylim=(1.1 * lowest, 1.1 * limit))
            axes.spines[["top", "right"]].set_visible(False)
        acceleration.set_xlabel("time (s)")
        speed.set_title(template.title or template.name, fontsize=14, fontweight="bold", color=INK)
        handles, labels = speed.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
        save(figure, path, DPI)


def _shade(axes: "Axes", plan: Plan) -> None:
    for i, line in enumerate(plan.painted):
        begin, end = plan.speeds.time_at(line.start_m), plan.speeds.time_at(line.end_m)
        axes.axvspan(begin, end, color=PAINTING, linewidth=0.0, zorder=0, label="_" if i else "painting")
