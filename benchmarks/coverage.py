"""Coverage of twenty fields by a roller: share of the reachable area, duration, and body inside the field.

The machine is that of the shipped vehicle; every field is planned by the default method with default options. Of the
salt pan, the first one, the figures of Fields2Cover 2.1 are known for the same width and turning circle: 2,434.8 m at
best with turns that leave the field; kept inside, 52 % is covered forward only and 72 % with cusps.

    python -m benchmarks coverage only=pond forward_only=1

`only` names the beginning of the fields that are planned; `forward_only` is for machines that never reverse.

Ends with exit code 1 if a field is covered less than 99 % of what can be reached, or the body leaves one.
"""

import sys
import time
from typing import Any

import shapely

from benchmarks._settings import Small
from touchline.schemas.catalogue import load_vehicle
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.template import Template
from touchline.services.planner.plan import plan

REQUIRED_PCT = 99.0
VEHICLE = "clay-roller"
SMALL = Small(
    {"only": "rectangle 40 x 30"},
    (
        "clay-roller reachable field time length outside planned",
        "rectangle 40 x 30 # % # % # min # m # cm # s",
    ),
)


def rectangle(length_m: float, width_m: float, *ponds: shapely.Polygon) -> shapely.Polygon:
    """A rectangle with ponds in it, its lower left corner at the origin."""
    return shapely.Polygon(shapely.box(0.0, 0.0, length_m, width_m).exterior, [pond.exterior for pond in ponds])


def round_pond(x_m: float, y_m: float, radius_m: float) -> shapely.Polygon:
    """A pond with 24 corners."""
    return shapely.Point(x_m, y_m).buffer(radius_m, quad_segs=6)


def fields() -> dict[str, shapely.Polygon]:
    """Twenty fields by name."""
    wide, tall = 50.0, 35.0
    notch = ((30, 35), (30, 15), (20, 15), (20, 35), (0, 35))
    return {
        "salt pan": rectangle(93.0, 47.6),
        "rectangle 25 x 25": rectangle(25.0, 25.0),
        "rectangle 40 x 30": rectangle(40.0, 30.0),
        "rectangle 60 x 20": rectangle(60.0, 20.0),
        "rectangle 80 x 50": rectangle(80.0, 50.0),
        "rectangle 120 x 30": rectangle(120.0, 30.0),
        "L": shapely.Polygon([(0, 0), (60, 0), (60, 25), (25, 25), (25, 50), (0, 50)]),
        "L, narrow": shapely.Polygon([(0, 0), (40, 0), (40, 15), (15, 15), (15, 40), (0, 40)]),
        "L, long": shapely.Polygon([(0, 0), (90, 0), (90, 20), (30, 20), (30, 45), (0, 45)]),
        "U": shapely.Polygon([(0, 0), (wide, 0), (wide, tall), *notch]),
        "U, wide": shapely.Polygon([(0, 0), (80, 0), (80, 45), (55, 45), (55, 20), (25, 20), (25, 45), (0, 45)]),
        "T": shapely.Polygon([(0, 40), (0, 22), (20, 22), (20, 0), (40, 0), (40, 22), (60, 22), (60, 40)]),
        "trapezium": shapely.Polygon([(0, 0), (60, 0), (48, 30), (12, 30)]),
        "trapezium, skew": shapely.Polygon([(0, 0), (70, 0), (70, 40), (0, 25)]),
        "parallelogram": shapely.Polygon([(0, 0), (55, 0), (70, 32), (15, 32)]),
        "rhombus": shapely.Polygon([(0, 20), (40, 0), (80, 20), (40, 40)]),
        "hexagon": shapely.Polygon([(30, 0), (15, 26), (-15, 26), (-30, 0), (-15, -26), (15, -26)]),
        "pond": rectangle(60.0, 45.0, round_pond(30.0, 22.0, 6.0)),
        "square pond": rectangle(70.0, 45.0, shapely.box(30.0, 18.0, 42.0, 28.0)),
        "two ponds": rectangle(80.0, 50.0, round_pond(22.0, 18.0, 5.0), round_pond(58.0, 30.0, 6.0)),
    }


def template_of(name: str, field: shapely.Polygon) -> Template:
    """The field as a template: one area, whose outline is the boundary."""
    rings = [[(float(x), float(y)) for x, y in ring.coords[:-1]] for ring in (field.exterior, *field.interiors)]
    area = {"id": "field", "outline": rings[0], "holes": rings[1:]}
    return Template.model_validate({"name": "field", "title": name, "areas": [area], "boundary": {"corners": rings[0]}})


def covered(name: str, field: shapely.Polygon, options: PlanOptions) -> dict[str, Any]:
    """The figures of one field."""
    begun = time.process_time()
    report = plan(template_of(name, field), load_vehicle(VEHICLE), options).report
    figures = report.coverage[0]
    return {
        "field": name,
        "of_reachable_pct": figures.reachable_pct,
        "coverage_pct": figures.coverage_pct,
        "minutes": report.total_time_s / 60.0,
        "length_m": report.total_length_m,
        "outside_m": figures.body_outside_m,
        "planning_s": time.process_time() - begun,
    }


def main(only: str = "", forward_only: int = 0) -> None:
    """Print the figures of every field; end with exit code 1 if one is not what is required."""
    options, wrong = PlanOptions(forward_only=bool(forward_only)), []
    print(f"{VEHICLE:<20}{'reachable':>11}{'field':>9}{'time':>10}{'length':>10}{'outside':>10}{'planned':>10}")
    for name, field in fields().items():
        if not name.startswith(only):
            continue
        try:
            row = covered(name, field, options)
        except PlanningError as error:
            wrong.append(f"{name}: {error}")
            continue
        print(
            f"{name:<20}{row['of_reachable_pct']:>9.2f} %{row['coverage_pct']:>7.2f} %{row['minutes']:>6.1f} min"
            f"{row['length_m']:>8.0f} m{100.0 * row['outside_m']:>7.1f} cm{row['planning_s']:>8.1f} s",
            flush=True,
        )
        if row["of_reachable_pct"] < REQUIRED_PCT or row["outside_m"] > 0.0:
            wrong.append(f"{name}: {row['of_reachable_pct']:.2f} %, {100.0 * row['outside_m']:.1f} cm outside")
    if wrong:
        sys.exit("not as required:\n" + "\n".join(wrong))
