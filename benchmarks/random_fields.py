"""Coverage of random fields by two sizes of roller, and growth of planning time with the field.

Polygons of 5 to 30 corners, every third with a hole, of about 0.1 to 0.9 ha, each planned for the shipped roller and
for one of half its size; then rectangles of 0.5 to 50 ha, planned for the shipped one.

    python -m benchmarks random_fields fields=40 seed=1 hectares=0.5,1,2

`hectares` are those of the rectangles, `corners` the most of a field, and with `holes=0` there are none.

Ends with exit code 1 if a field is covered less than 98.5 % of what can be reached, or the body leaves one. A field
that is refused is printed with the reason.
"""

import math
import sys
import time
from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely

from benchmarks._settings import Small
from touchline.schemas.catalogue import load_vehicle
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import plan

REQUIRED_PCT = 98.5
VEHICLE = "clay-roller"
HALF_SIZE_SCALED = {
    "body": ("footprint_m", "gnss_antenna_z_m", "radius_of_gyration_m"),
    "drive": ("wheelbase_m", "drum_width_m", "rear_wheel_width_m"),
    "tool": ("rolled_width_m",),
}
SMALL = Small(
    {"fields": 1, "seed": 8, "corners": 5, "holes": 0, "hectares": "0.1,0.2"},
    (
        "# clay-roller # corners, # m² # % # cm outside # lanes # s",
        "# half-roller # corners, # m² # % # cm outside # lanes # s",
        "# ha # lanes # s # % as lanes to the power of #",
    ),
)


def template_of(name: str, field: shapely.Polygon) -> Template:
    """The field as a template: one area, whose outline is the boundary."""
    rings = [[(float(x), float(y)) for x, y in ring.coords[:-1]] for ring in (field.exterior, *field.interiors)]
    area = {"id": "field", "outline": rings[0], "holes": rings[1:]}
    return Template.model_validate({"name": "field", "title": name, "areas": [area], "boundary": {"corners": rings[0]}})


def half_size(vehicle: Vehicle) -> Vehicle:
    """The vehicle with half its lengths, and bends twice as tight; drum and motor stay."""
    parts = vehicle.model_dump()
    for part, names in HALF_SIZE_SCALED.items():
        for name in names:
            parts[part][name] = (0.5 * np.array(parts[part][name])).tolist()
    parts["drive"]["default_kappa_max_1pm"] *= 2.0
    return Vehicle.model_validate({**parts, "name": "half-roller"})


def random_field(rng: np.random.Generator, most_corners: int, *, holed: bool) -> shapely.Polygon:
    """A polygon about a middle: corners at random bearings and distances."""
    corners = int(rng.integers(5, most_corners + 1))
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


def random_fields(count: int, seed: int, most_corners: int, *, holes: bool) -> list[str]:
    """Plan random fields and print them; return violations of the requirements."""
    rng, shipped = np.random.default_rng(seed), load_vehicle(VEHICLE)
    wrong = []
    for number in range(count):
        field = random_field(rng, most_corners, holed=holes and number % 3 == 0)
        kind = f"{len(field.exterior.coords) - 1} corners{', hole' if field.interiors else ''}, {field.area:.0f} m²"
        for vehicle in (shipped, half_size(shipped)):
            name = f"{number:2} {vehicle.name:<12}{kind:<30}"
            try:
                row = planned(field, vehicle)
            except PlanningError as error:
                print(f"{name} refused: {error}", flush=True)
                continue
            print(
                f"{name}{row['of_reachable_pct']:>8.2f} %{100.0 * row['outside_m']:>7.1f} cm outside"
                f"{row['lanes']:>5} lanes{row['planning_s']:>8.1f} s",
                flush=True,
            )
            if row["of_reachable_pct"] < REQUIRED_PCT or row["outside_m"] > 0.0:
                wrong.append(f"{name}: {row['of_reachable_pct']:.2f} %, {100.0 * row['outside_m']:.1f} cm outside")
    return wrong


def growth(sizes_ha: Sequence[float]) -> None:
    """Plan rectangles, two by one; prints the exponent of how planning grows with the lanes since the last, too."""
    vehicle, last = load_vehicle(VEHICLE), dict[str, Any]()
    for hectares in sizes_ha:
        width_m = math.sqrt(1e4 * hectares / 2.0)
        row = planned(shapely.box(0.0, 0.0, 2.0 * width_m, width_m), vehicle)
        since = ""
        if last:
            by = math.log(row["planning_s"] / last["planning_s"]) / math.log(row["lanes"] / last["lanes"])
            since = f"  as lanes to the power of {by:.2f}"
        last = row
        print(
            f"{hectares:6.1f} ha{row['lanes']:>6} lanes{row['planning_s']:>8.1f} s"
            f"{row['of_reachable_pct']:>8.2f} %{since}",
            flush=True,
        )


def main(
    fields: int = 40, seed: int = 1, corners: int = 30, holes: int = 1, hectares: str = "0.5,1,2,5,10,20,50"
) -> None:
    """Print the figures; end with exit code 1 if a field is not as required."""
    wrong = random_fields(fields, seed, corners, holes=bool(holes))
    growth([float(each) for each in hectares.split(",")])
    if wrong:
        sys.exit("not as required:\n" + "\n".join(wrong))
