"""Covering random fields by two sizes of roller, and how planning grows with the field.

Polygons of 5 to 30 corners, every third with a hole, of about 0.1 to 0.9 ha, each planned for the shipped roller and
for one of half its size; then rectangles of 0.5 to 50 ha, planned for the shipped one.

    python -m benchmarks.random_fields [--fields 40] [--seed 1] [--up-to HECTARES]

Ends with exit code 1 if a field is covered less than 98.5 % of what can be reached, or the body leaves one. A field
that is refused is printed with the reason.
"""

import argparse
import math
import sys
import time
from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely

from benchmarks.coverage import VEHICLE, rectangle, template_of
from touchline.schemas.catalogue import load_vehicle
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import plan

REQUIRED_PCT = 98.5
HECTARES = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
HALF_SIZE_SCALED = {
    "body": ("footprint_m", "gnss_antenna_z_m", "radius_of_gyration_m"),
    "drive": ("wheelbase_m", "drum_width_m", "rear_wheel_width_m"),
    "tool": ("rolled_width_m",),
}


def half_size(vehicle: Vehicle) -> Vehicle:
    """The vehicle with half its lengths, and bends twice as tight; drum and motor stay."""
    parts = vehicle.model_dump()
    for part, names in HALF_SIZE_SCALED.items():
        for name in names:
            parts[part][name] = (0.5 * np.array(parts[part][name])).tolist()
    parts["drive"]["default_kappa_max_1pm"] *= 2.0
    return Vehicle.model_validate({**parts, "name": "half-roller"})


def random_field(rng: np.random.Generator, holed: bool) -> shapely.Polygon:
    """A polygon about a middle: corners at random bearings and distances."""
    corners = int(rng.integers(5, 31))
    reach_m = math.sqrt(rng.uniform(500.0, 5000.0))
    bearings = np.sort(rng.uniform(0.0, math.tau, corners))
    distances = reach_m * rng.uniform(0.5, 1.0, corners)
    field = shapely.Polygon(np.column_stack((distances * np.cos(bearings), distances * np.sin(bearings))))
    middle = field.representative_point()
    room_m = shapely.distance(middle, field.exterior)
    hole = middle.buffer(rng.uniform(0.2, 0.5) * room_m, quad_segs=3)
    return shapely.Polygon(field.exterior, [hole.exterior]) if holed else field


def planned(field: shapely.Polygon, vehicle: Vehicle) -> dict[str, Any]:
    """The figures of one plan; processor time, which does not count what else the machine does."""
    begun = time.process_time()
    report = plan(template_of("field", field), vehicle, PlanOptions()).report
    figures = report.coverage[0]
    return {
        "of_reachable_pct": figures.reachable_pct,
        "outside_m": figures.body_outside_m,
        "lanes": figures.lanes,
        "planning_s": time.process_time() - begun,
    }


def random_fields(count: int, seed: int) -> tuple[list[dict[str, Any]], list[str]]:
    """The rows of all random fields, and what is not as required."""
    rng, shipped = np.random.default_rng(seed), load_vehicle(VEHICLE)
    rows, wrong = [], []
    for number in range(count):
        field = random_field(rng, holed=number % 3 == 0)
        kind = f"{len(field.exterior.coords) - 1} corners{', hole' if field.interiors else ''}, {field.area:.0f} m²"
        for vehicle in (shipped, half_size(shipped)):
            name = f"{number:2} {vehicle.name:<12}{kind:<30}"
            try:
                row = planned(field, vehicle)
            except PlanningError as error:
                print(f"{name} refused: {error}", flush=True)
                continue
            rows.append({"field": number, "vehicle": vehicle.name, **row})
            print(
                f"{name}{row['of_reachable_pct']:>8.2f} %{100.0 * row['outside_m']:>7.1f} cm outside"
                f"{row['lanes']:>5} lanes{row['planning_s']:>8.1f} s",
                flush=True,
            )
            if row["of_reachable_pct"] < REQUIRED_PCT or row["outside_m"] > 0.0:
                wrong.append(f"{name}: {row['of_reachable_pct']:.2f} %, {100.0 * row['outside_m']:.1f} cm outside")
    return rows, wrong


def growth(up_to_ha: float) -> list[dict[str, Any]]:
    """The rows of rectangles, two by one, with the exponent of how planning grows with the lanes since the last."""
    vehicle, rows = load_vehicle(VEHICLE), list[dict[str, Any]]()
    for hectares in HECTARES:
        if hectares > up_to_ha:
            break
        width_m = math.sqrt(1e4 * hectares / 2.0)
        row = {"hectares": hectares, **planned(rectangle(2.0 * width_m, width_m), vehicle)}
        since = ""
        if rows:
            by = math.log(row["planning_s"] / rows[-1]["planning_s"]) / math.log(row["lanes"] / rows[-1]["lanes"])
            since = f"  as lanes to the power of {by:.2f}"
        rows.append(row)
        print(
            f"{hectares:6.1f} ha{row['lanes']:>6} lanes{row['planning_s']:>8.1f} s"
            f"{row['of_reachable_pct']:>8.2f} %{since}",
            flush=True,
        )
    return rows


def main(arguments: Sequence[str] = ()) -> dict[str, Any]:
    """Print and return the figures; end with exit code 1 if a field is not as required."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fields", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--up-to", type=float, default=HECTARES[-1], metavar="HECTARES")
    asked = parser.parse_args(list(arguments))
    rows, wrong = random_fields(asked.fields, asked.seed)
    grown = growth(asked.up_to)
    if wrong:
        sys.exit("not as required:\n" + "\n".join(wrong))
    return {"fields": rows, "growth": grown}


if __name__ == "__main__":
    main(sys.argv[1:])
