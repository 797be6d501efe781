"""Random fields of awkward shapes, planned for two sizes of roller and a mower in turn: none ends in a traceback.

Fields have 5 to 60 corners, every third a hole, some a needle (a corner drawn far out) or a slit (a notch a few
centimetres wide), 0.05 to 5 ha for rollers and up to 0.2 ha for the mower, evenly over the logarithm.

`python -m benchmarks fields`; `runs` is the number of fields, `hectares` the area of each instead. A plan that takes
more than PATIENCE_S is aborted. Ends with exit code 1 if one ends with anything but a plan or a reason.
"""

import math
import sys
import time
import traceback
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely
from pydantic import ValidationError

from benchmarks._settings import Small
from benchmarks.random_fields import half_size, template_of
from touchline.schemas.catalogue import load_vehicle
from touchline.schemas.errors import PlanningError
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import plan

PATIENCE_S = 90.0
HECTARES, MOWER_HECTARES = (0.05, 5.0), (0.05, 0.2)
NEEDLE_SHARE, SLIT_SHARE, HOLE_EVERY = 0.25, 0.25, 3
SMALL = Small(
    {"runs": 1, "seed": 3, "hectares": 0.004},
    (
        "# clay-roller # corners, hole, # m² # % # s planned",
        "clay-roller {'planned': #}; covered of the reachable: p5 # %, median # %; median # s",
    ),
)


class PlanTimeoutError(Exception):
    """Raised when a plan takes too long."""


class FieldPlan(NamedTuple):
    """Outcome of planning a field: ending, coverage of the reachable area (%), and seconds."""

    number: int
    vehicle: str
    kind: str
    ending: str
    reachable_pct: float
    seconds: float
    outside_m: float


def mower() -> Vehicle:
    """A small machine on two driven wheels whose body is wider than its tool."""
    drive = {
        "default_kappa_max_1pm": 1.125,
        "max_acceleration_mps2": 1.0,
        "track_width_m": 0.5,
        "wheel_radius_m": 0.1,
        "transit_speed_mps": 1.4,
        "casters_m": [[0.45, 0.2], [0.45, -0.2]],
    }
    outline = [[0.5, -0.33], [0.5, 0.33], [-0.35, 0.33], [-0.35, -0.33]]
    parts = Vehicle().model_dump(mode="json")
    parts["drive"] |= drive
    parts["body"] |= {"footprint_m": outline, "gnss_antenna_x_m": 0.0, "gnss_antenna_y_m": 0.0}
    parts["tool"] = {"kind": "roller", "rolled_width_m": 0.6, "roll_speed_mps": 1.0}
    return Vehicle.model_validate({**parts, "name": "mower"})


def awkward_field(rng: np.random.Generator, area_m2: float, *, holed: bool) -> shapely.Polygon:
    """Create a polygon about a centre, with corners at random bearings and distances, needles and slits."""
    corners = int(rng.integers(5, 61))
    bearings = np.sort(rng.uniform(0.0, math.tau, corners))
    distances = rng.uniform(0.35, 1.0, corners)
    if rng.random() < NEEDLE_SHARE:
        distances[int(rng.integers(corners))] *= rng.uniform(2.0, 4.0)
    field = shapely.Polygon(np.column_stack((distances * np.cos(bearings), distances * np.sin(bearings))))
    size = math.sqrt(area_m2 / field.area)
    field = shapely.transform(field, lambda points: points * size)
    if rng.random() < SLIT_SHARE:
        bearing, reach_m = rng.uniform(0.0, math.tau), rng.uniform(0.3, 0.8) * size
        line = shapely.LineString([(0.4 * reach_m, 0.0), (4.0 * size, 0.0)])
        slit = shapely.affinity.rotate(line, bearing, origin=(0.0, 0.0), use_radians=True).buffer(
            rng.uniform(0.01, 0.1)
        )
        parts = shapely.get_parts(shapely.difference(field, slit))
        field = max((part for part in parts if part.geom_type == "Polygon"), key=shapely.area)
    if not holed:
        return shapely.Polygon(field.exterior)
    middle = field.representative_point()
    hole = middle.buffer(rng.uniform(0.05, 0.6) * shapely.distance(middle, field.exterior), quad_segs=3)
    return shapely.Polygon(field.exterior, [hole.exterior])


def planned_fields(numbers: Sequence[int], seed: int, hectares: tuple[float, float] | None = None) -> list[FieldPlan]:
    """Plan fields; each depends only on the seed and its number."""
    roller = load_vehicle("clay-roller")
    vehicles = [(roller, HECTARES), (half_size(roller), HECTARES), (mower(), MOWER_HECTARES)]
    found = []
    for number in numbers:
        vehicle, sizes = vehicles[number % len(vehicles)]
        rng = np.random.default_rng((seed, number))
        least, most = hectares or sizes
        area_m2 = 1e4 * math.exp(rng.uniform(math.log(least), math.log(most)))
        field = awkward_field(rng, area_m2, holed=number // len(vehicles) % HOLE_EVERY == 0)
        kind = f"{len(field.exterior.coords) - 1} corners{', hole' if field.interiors else ''}, {field.area:.0f} m²"
        found.append(_planned(number, vehicle, kind, field))
    return found


def _planned(number: int, vehicle: Vehicle, kind: str, field: shapely.Polygon) -> FieldPlan:
    begun, ending, pct, outside_m = time.process_time(), "planned", math.nan, math.nan

    def check_patience(stage: str, fraction: float) -> None:
        if time.process_time() - begun > PATIENCE_S:
            raise PlanTimeoutError

    try:
        figures = plan(template_of("field", field), vehicle, None, check_patience).report.coverage[0]
        pct, outside_m = figures.reachable_pct, figures.body_outside_m
    except PlanningError as error:
        ending = f"refused: {error.problem}"
    except ValidationError:  # of the template: a slit may leave an outline that touches itself
        ending = "refused: no usable outline"
    except PlanTimeoutError:
        ending = "timed out"
    except Exception as error:  # noqa: BLE001 - what this looks for
        traceback.print_exc()
        ending = f"traceback: {error!r}"
    row = FieldPlan(number, vehicle.name, kind, ending, pct, time.process_time() - begun, outside_m)
    covered = f"{pct:8.2f} %" if ending == "planned" else f"{'-':>10}"
    print(f"{number:3} {vehicle.name:<12}{kind:<32}{covered}{row.seconds:7.1f} s  {ending}", flush=True)
    return row


def main(runs: int = 500, seed: int = 1, hectares: float = 0.0) -> None:
    """Print the figures; end with exit code 1 after a traceback."""
    rows = planned_fields(range(runs), seed, (hectares, hectares) if hectares else None)
    for name in dict.fromkeys(row.vehicle for row in rows):
        mine = [row for row in rows if row.vehicle == name]
        endings = Counter(row.ending.split(":")[0] for row in mine)
        covered = [row.reachable_pct for row in mine if row.ending == "planned"]
        shares = f"p5 {np.percentile(covered, 5):.2f} %, median {np.median(covered):.2f} %" if covered else "-"
        print(
            f"{name:<12}{dict(endings)}; covered of the reachable: {shares};"
            f" median {np.median([row.seconds for row in mine]):.1f} s"
        )
    if any(row.ending.startswith("traceback") for row in rows):
        sys.exit("some ended in a traceback")
