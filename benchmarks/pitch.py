"""A pitch with its goals, nets, corner flags and a bench, known to the plan and unknown: metres painted of each line.

`python -m benchmarks pitch`; `examples/templates/pitch-with-goals.json` is painted by
`examples/vehicles/marker-lidar.json`, with all things in the plan and with none of them. `worlds` chooses one of these;
of the lines those are painted whose ids begin with `lines`. The columns, all in metres:

- `painted` and `left out`: along the line, by a raster of the true paint
- `touches`: where the body would touch a thing in either direction
- `too near`: where it would be nearer to one than it has to keep, so that protection lets it drive: from things that
  the plan knows, which stand, and from others, which may move in mode `passive`
- `more`: what is left out beyond `too near`, for each end of such a stretch; a robot that paints at speed needs room
  to brake straight on there, or to gather speed

Ends with exit code 1 after a contact, if a report of what is left out is not true, or if `more` is above `ALLOWED_M`.
"""

import sys
import time
from typing import Final, NamedTuple

import numpy as np

from benchmarks._body_bound import ends_in, out_of_reach
from benchmarks._settings import Small
from benchmarks._true_paint import RASTER_M, TRUE_M, Bools, painted_cells, untrue_m
from touchline.jobs.single.simulation import Job, Products
from touchline.jobs.way_round.drives_report import gap_figures
from touchline.jobs.way_round.way_round_simulation import WayRoundDrives, simulate_way_round
from touchline.schemas.catalogue import load_template, load_vehicle
from touchline.schemas.messages import PaintMarks, PlanOptions
from touchline.schemas.scenario import Scenario
from touchline.schemas.scenario_objects import Kind, ScenarioObject
from touchline.schemas.standing_clearance import standing_clearance_m
from touchline.schemas.template import Polygon, Template, TemplateSegment
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.way_round.rest_request import passing_m

TEMPLATE: Final = "examples/templates/pitch-with-goals.json"
VEHICLE: Final = "examples/vehicles/marker-lidar.json"
KNOWN, UNKNOWN = "known", "unknown"
KINDS: Final[dict[str, Kind]] = {"net": "wall", "bench": "bench"}
"""Kinds of things by the ends of their ids; others are posts."""
ALLOWED_M: Final = {KNOWN: 0.85, UNKNOWN: 0.6}
"""Length that may be left out beyond what is too near, for each end of it: 0.51 m to brake from 1 m/s, and, of known
things, the 0.3 m by which the planner shortens a part that cannot be reached."""
SMALL = Small(
    {"worlds": "known", "lines": "penalty-area-west-n"},
    (
        "known: length painted left out touches too near more",
        "all # # # # # #",
        "known: # contacts in motion, # at rest; # m to be kept; # m reported as left out, untrue by # m; # drives",
    ),
)


class LineRow(NamedTuple):
    """Figures of one line, or of all together, in metres."""

    name: str
    length_m: float
    painted_m: float
    touches_m: float
    too_near_m: float
    ends: int

    @property
    def left_out_m(self) -> float:
        """Length of the line that is not painted (m)."""
        return self.length_m - self.painted_m

    @property
    def more_m(self) -> float:
        """Length left out beyond what is too near, for each end (m)."""
        return (self.left_out_m - self.too_near_m) / max(self.ends, 1)


def main(worlds: str = "known,unknown", lines: str = "", seed: int = 1) -> None:
    """Paint the pitch in each world, and print the tables."""
    pitch = load_template(TEMPLATE)
    chosen = tuple(segment for segment in pitch.segments if segment.id.startswith(lines))
    whole = pitch.model_copy(update={"segments": chosen})
    failed = [world for world in worlds.split(",") if not _paints(world, whole, seed)]
    if failed:
        sys.exit(f"not as required: {', '.join(failed)}")


def _paints(world: str, whole: Template, seed: int) -> bool:
    """Paint the pitch, print the table, and return whether all is as required."""
    vehicle, known, begun = load_vehicle(VEHICLE), world == KNOWN, time.process_time()
    template = whole if known else whole.model_copy(update={"obstacles": ()})
    objects = () if known else tuple(map(_thing, whole.obstacles))  # known ones stand in the world by themselves
    job, emulator = (
        Job.prepare(template, PlanOptions(), vehicle),
        Emulator(vehicle, Scenario(seed=seed, objects=objects)),
    )
    drives = WayRoundDrives(emulator, job)
    outcome = simulate_way_round(job, emulator, Products(strokes=True), drives=drives)
    figures, gaps = outcome.figures(job), gap_figures(drives.way_round.left_out.stretches)
    braking_mps2 = emulator.onboard.protection.braking_mps2
    kept_m = standing_clearance_m(vehicle) if known else passing_m(vehicle, braking_mps2)
    rows = [_row(segment, whole.obstacles, vehicle, kept_m, outcome.strokes) for segment in whole.segments]
    off_m = untrue_m(whole, gaps["stretches"], outcome.strokes)
    contacts = figures.get("contacts", {"while_moving": 0, "at_rest": 0})
    _print(world, rows)
    print(f"{world}: {contacts['while_moving']} contacts in motion, {contacts['at_rest']} at rest; ", end="")
    print(f"{kept_m:.2f} m to be kept; {gaps['total_m']:.2f} m reported as left out, untrue by {off_m:.3f} m; ", end="")
    print(f"{len(outcome.drives)} drives, {figures['traversal']['total_time_s']:.0f} s", end="")
    print(f" in {time.process_time() - begun:.0f} s; {figures['reason'] or 'finished'}", flush=True)
    within = all(row.more_m <= ALLOWED_M[world] for row in rows)
    return within and off_m <= TRUE_M and not contacts["while_moving"] and not contacts["at_rest"]


def _thing(outline: Polygon) -> ScenarioObject:
    """Return the thing that an outline of a template stands for."""
    kind = next((kind for end, kind in KINDS.items() if outline.id.endswith(end)), "post")
    x, y = np.mean(outline.corners, axis=0).tolist()
    corners = tuple((corner[0] - x, corner[1] - y) for corner in outline.corners)
    return ScenarioObject(kind=kind, name=outline.id, x_m=x, y_m=y, outline=corners)


def _row(
    line: TemplateSegment,
    things: tuple[Polygon, ...],
    vehicle: Vehicle,
    kept_m: float,
    strokes: list[PaintMarks],
) -> LineRow:
    curve = line.curve()
    touches, too_near = (out_of_reach(curve, things, vehicle, distance_m) for distance_m in (0.0, kept_m))
    painted_m, *others_m = (_length_m(cells) for cells in (painted_cells(curve, strokes), touches, too_near))
    return LineRow(line.id, curve.length_m, painted_m, others_m[0], others_m[1], ends_in(too_near))


def _length_m(cells: Bools) -> float:
    return RASTER_M * float(np.count_nonzero(cells))


def _print(world: str, rows: list[LineRow]) -> None:
    """Print the lines with a thing in their way, the others together, and all."""
    met = [row for row in rows if row.ends or row.left_out_m > 0.05]
    print(f"{world + ':':27} length  painted  left out  touches  too near   more")
    for row in (*met, _total("others", [row for row in rows if row not in met]), _total("all", rows)):
        print(f"{row.name:26} {row.length_m:7.2f} {row.painted_m:8.2f} {row.left_out_m:9.2f}", end="")
        print(f" {row.touches_m:8.2f}", end="")
        print(f" {row.too_near_m:9.2f} {row.more_m:6.2f}")


def _total(name: str, rows: list[LineRow]) -> LineRow:
    return LineRow(
        name,
        sum(row.length_m for row in rows),
        sum(row.painted_m for row in rows),
        sum(row.touches_m for row in rows),
        sum(row.too_near_m for row in rows),
        sum(row.ends for row in rows),
    )
