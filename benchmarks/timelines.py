"""Jobs among things that no plan knows: contacts, how each job ends, what is left out, and the time that it costs.

`python -m benchmarks timelines`; `runs` random timelines from `seed` on, on the `fields` by turns, with 5 to 40 things
of which a third move at walking speed. What a report says is left out is compared with a raster of the true paint. Ends
with exit code 1 after a contact in motion, or if a report is not true.
"""

import math
import sys
import time
from collections import Counter
from typing import Final, NamedTuple

import numpy as np

from benchmarks._settings import Small
from benchmarks._stops_for_things import with_lidar
from benchmarks._true_paint import TRUE_M, untrue_m
from benchmarks._unknown_things import Box, random_things
from touchline.jobs.single.simulation import Job, Products, simulate
from touchline.jobs.way_round.way_round_simulation import simulate_job
from touchline.schemas.catalogue import load_template, load_vehicle
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.scenario import Scenario
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.bumper_strip_spec import BumperStripSpec
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.loaded_job import lines_and_start

VEHICLES: Final = {"soccer-7": "turf-tank-two", "salt-pan": "clay-roller"}
HARDEST_N: Final = 10_000.0
BEYOND_M: Final = 2.0
"""Margin round a field within which things are."""
SMALL = Small(
    {"runs": 1, "fields": "study-square"},
    (
        "# study-square # things # drives # contacts in motion # at rest # m left out (untrue by # m) # s in # s",
        "# jobs: # contacts in motion, # with the robot at rest; # reports not true",
        "study-square # jobs",
    ),
)


class Timeline(NamedTuple):
    """Outcome of one job among things."""

    field: str
    ending: str
    moving: int
    at_rest: int
    left_out_m: float
    untrue_m: float
    time_s: float


def main(runs: int = 200, seed: int = 1, fields: str = "soccer-7,salt-pan") -> None:
    """Run the jobs, and print the figures."""
    names = fields.split(",")
    jobs = {name: Job.prepare(load_template(name), PlanOptions(), _vehicle(name)) for name in names}
    alone_s = {name: _alone_s(job) for name, job in jobs.items()}
    rows = [_run(number, names[number % len(names)], jobs) for number in range(seed, seed + runs)]
    untrue = sum(row.untrue_m > TRUE_M for row in rows)
    print(f"{len(rows)} jobs: {sum(row.moving for row in rows)} contacts in motion, ", end="")
    print(f"{sum(row.at_rest for row in rows)} with the robot at rest; {untrue} reports not true")
    for name in names:
        mine = [row for row in rows if row.field == name]
        if mine:
            lines_m = sum(segment.curve().length_m for segment in jobs[name].template.segments)
            share = np.mean([row.left_out_m for row in mine]) / lines_m if lines_m else math.nan
            longer = np.mean([row.time_s for row in mine]) / alone_s[name]
            print(f"{name} {len(mine)} jobs: {dict(Counter(row.ending for row in mine))}; ", end="")
            print(f"{100.0 * share:.1f} % of the lines left out; {longer:.2f} times as long")
    if untrue or any(row.moving for row in rows):
        sys.exit(1)


def _vehicle(field: str) -> Vehicle:
    """Return a vehicle with a lidar, and a bumper that nobody presses who runs into it: that would end the job."""
    vehicle = with_lidar(load_vehicle(VEHICLES.get(field, "turf-tank-two")))
    strip = BumperStripSpec(name="nose", from_m=0.0, to_m=0.1, least_n=HARDEST_N)
    return vehicle.model_copy(update={"sensors": (*vehicle.sensors, strip)})


def _alone_s(job: Job) -> float:
    """Time of the job with nothing in the way."""
    return simulate(job, Scenario(seed=1)).report.total_time_s


def _run(number: int, field: str, jobs: dict[str, Job]) -> Timeline:
    job, rng, begun = jobs[field], np.random.default_rng(number), time.process_time()
    _, start = lines_and_start(job.trajectory, job.template, job.vehicle, ())
    things = random_things(rng, _box(job.template), start[:2])
    scenario = Scenario(seed=number, objects=things)
    try:
        outcome = simulate_job(job, Emulator(job.vehicle, scenario), Products(strokes=True))
        figures = outcome.figures(job)
    except TouchlineError as error:
        raise SystemExit(f"timeline {number}: {error}") from error
    contacts = figures.get("contacts", {"while_moving": 0, "at_rest": 0})
    gaps = figures.get("gaps", {"total_m": 0.0, "stretches": []})
    off_m = untrue_m(job.template, gaps["stretches"], outcome.strokes)
    row = Timeline(
        field,
        figures["reason"].split(":")[0] or "finished",
        contacts["while_moving"],
        contacts["at_rest"],
        gaps["total_m"],
        off_m,
        figures["traversal"]["total_time_s"],
    )
    print(f"{number:4} {field:10} {len(things):3} things {len(figures.get('drives', [1])):3} drives ", end="")
    print(f"{row.moving:2} contacts in motion {row.at_rest:3} at rest {row.left_out_m:7.2f} m left out ", end="")
    print(
        f"(untrue by {off_m:.3f} m) {row.time_s:7.1f} s in {time.process_time() - begun:.0f} s  {row.ending}",
        flush=True,
    )
    return row


def _box(template: Template) -> Box:
    lines = [np.column_stack(segment.curve().at([0.0, segment.curve().length_m])[:2]) for segment in template.segments]
    points = np.concatenate([*lines, *(np.array(area.outline) for area in template.areas)])
    low, high = points.min(axis=0) - BEYOND_M, points.max(axis=0) + BEYOND_M
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])
