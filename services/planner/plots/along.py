"""Plot of a plan's path coloured by speed or curvature."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from touchline.schemas.curves import PathTable
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.plan import Plan
from touchline.services.planner.plots.actuator_series import actuator_series

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import LineCollection

STEP_M = 0.1
PAINTED_PT, TRANSITION_PT, CASING_PT = 3.0, 1.5, 5.0
# Number of colours, so that a straight is one line and not hundreds.
LEVELS = 96
# Curvatures below this (1/m) are spread out, tighter ones compressed, so that circles show beside turns.
WIDE_TURN_1PM = 0.1


class Quantity(NamedTuple):
    """Quantity to colour by: label and marks of the colour bar, and colours from minimum to maximum."""

    label: str
    colours: Sequence[str]
    marks: Sequence[float] | None = None


QUANTITIES = {
    "speed": Quantity("speed (m/s)", ("#7a0403", "#e4572e", "#f2a900", "#2a9d8f", "#1d3557")),
    "curvature": Quantity(
        "curvature (1/m), left positive",
        ("#8e0152", "#e9489d", "#5b5b5b", "#1fb5a5", "#003c5f"),
        (-3.0, -1.0, -0.3, -0.1, 0.0, 0.1, 0.3, 1.0, 3.0),
    ),
}


def draw_along(axes: "Axes", plan: Plan, quantity: str) -> "LineCollection":
    """Draw the robot's path by `quantity` ("speed" or "curvature"), thick and edged in white while it paints.

    Returns the artist that a colour bar needs.
    """
    from matplotlib.collections import LineCollection
    from matplotlib.colors import AsinhNorm, LinearSegmentedColormap, Normalize

    series = actuator_series(plan, STEP_M)
    table = PathTable.from_curves([sent.curve for sent in plan.sent])
    x, y, _, _ = table.at(series.station_m)
    points = np.column_stack((x, y))
    values = np.abs(series.speed_mps) if quantity == "speed" else series.curvature_1pm
    most = float(np.abs(values).max()) or 1.0
    norm = Normalize(0.0, most) if quantity == "speed" else AsinhNorm(WIDE_TURN_1PM, -most, most)
    colours = LinearSegmentedColormap.from_list(quantity, list(QUANTITIES[quantity].colours))
    painting = _painting(plan, series.station_m)
    shades = np.round(np.asarray(norm(values)) * LEVELS)
    begins = np.flatnonzero(np.concatenate(([True], (np.diff(shades) != 0.0) | (np.diff(painting.astype(int)) != 0))))
    ends = np.append(begins[1:], len(points) - 1)
    straight = np.maximum.reduceat(np.abs(series.curvature_1pm), begins) == 0.0
    runs = [
        points[[begin, end]] if ahead else points[begin : end + 1]
        for begin, end, ahead in zip(begins, ends, straight, strict=True)
    ]
    painted = painting[begins]
    casing = [run for run, paints in zip(runs, painted, strict=True) if paints]
    axes.add_collection(LineCollection(casing, color="white", linewidth=CASING_PT, zorder=3))
    lines = LineCollection(runs, array=values[begins], cmap=colours, norm=norm, zorder=4)
    lines.set(linewidth=np.where(painted, PAINTED_PT, TRANSITION_PT))
    axes.add_collection(lines)
    return lines


def _painting(plan: Plan, station: Floats) -> Floats:
    inside = np.zeros(len(station), dtype=bool)
    for line in plan.painted:
        inside |= (station >= line.start_m) & (station <= line.end_m)
    return inside
