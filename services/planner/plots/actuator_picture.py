"""Plot of a plan's actuators over time: commanded values, rates, limits, and paint flow."""

from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import Plan
from touchline.services.planner.plots.actuator_series import actuator_series
from touchline.services.planner.plots.style import INK, plan_style, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes

STEP_M = 0.02
COLOURS, LIMIT, PAINTING = ("#1769aa", "#d9480f", "#2a9d8f", "#8e0152"), "#8a8f98", "#dfe9d8"
DPI = 160
HEIGHT_IN = 3.0


def plot_actuators(plan: Plan, template: Template, vehicle: Vehicle, path: Path | str) -> None:
    """Draw the actuators of `plan` to `path`, in the format of its suffix (.svg, .png, .pdf).

    Raises:
        ValueError: There is no such format.
        OSError: The file cannot be written.
    """
    from matplotlib.figure import Figure

    series, kinds = actuator_series(plan, STEP_M), []
    for _, group in groupby(enumerate(vehicle.drive.actuators), key=lambda numbered: numbered[1].quantity):
        numbers, actuators = zip(*group, strict=True)
        first = actuators[0]
        names = [f"{each.name} {each.quantity.partition(' ')[0]}" for each in actuators]
        for values, limit, text in (
            (series.value, first.limit, f"{first.quantity} ({first.unit})"),
            (series.rate, first.rate_limit, f"{first.rate} ({_per_second(first.unit)})"),
        ):
            kinds.append((values[list(numbers)], limit, text, names))
    with plan_style():
        figure = Figure(figsize=(11.0, HEIGHT_IN * len(kinds)), layout="constrained")
        rows = np.atleast_1d(figure.subplots(len(kinds), 1, sharex=True))
        for axes, (values, limit, text, names) in zip(rows, kinds, strict=True):
            _shade(axes, plan)
            for value, name, colour in zip(values, names, COLOURS, strict=False):
                axes.plot(series.time_s, value, color=colour, linewidth=0.9, label=name)
            lowest = -limit if values.min() < 0.0 else 0.0
            for level in {limit, lowest} - {0.0}:
                axes.axhline(level, color=LIMIT, linewidth=1.0, linestyle=(0, (4, 3)))
            axes.plot([], [], color=LIMIT, linewidth=1.0, linestyle=(0, (4, 3)), label="limit")
            axes.set(ylabel=text, xlim=(0.0, plan.speeds.total_time_s), ylim=(1.1 * lowest, 1.1 * limit))
            axes.spines[["top", "right"]].set_visible(False)
        rows[-1].set_xlabel("time (s)")
        rows[0].set_title(template.title or template.name, fontsize=14, fontweight="bold", color=INK)
        labelled = {
            label: handle for axes in rows for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
        }
        figure.legend(labelled.values(), labelled, loc="outside lower center", ncols=4, frameon=False)
        save(figure, path, DPI)


def _per_second(unit: str) -> str:
    return "rad/s²" if unit == "rad/s" else f"{unit}/s"


def _shade(axes: "Axes", plan: Plan) -> None:
    for i, line in enumerate(plan.painted):
        begin, end = plan.speeds.time_at(line.start_m), plan.speeds.time_at(line.end_m)
        axes.axvspan(begin, end, color=PAINTING, linewidth=0.0, zorder=0, label="_" if i else "painting")
