"""Jobs that timelines run among things: lines, an area and goals, and what came of each."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from benchmarks._stops_for_things import with_lidar
from benchmarks._true_ground import covered_cells, untrue_m2
from benchmarks._true_paint import TRUE_M, painted_m, untrue_m
from benchmarks._unknown_things import Box, random_things
from touchline.jobs.goal.arrival import ARRIVED_M
from touchline.jobs.goal.goal_simulation import drive_to_goal
from touchline.jobs.single.simulation import Job, Products, simulate
from touchline.jobs.way_round.way_round_simulation import simulate_job
from touchline.schemas.catalogue import load_template, load_vehicle
from touchline.schemas.messages import PlanOptions, PoseGoal
from touchline.schemas.scenario import Pose2, Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.bumper_strip_spec import BumperStripSpec
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.loaded_job import lines_and_start

HARDEST_N = 10_000.0
BEYOND_M = 2.0
SMALL_BEYOND_M = 8.0
"""Margins round a whole field, and round a small job, within which things are."""
GOAL_M = (8.0, 16.0)
"""Distance of goals from the start."""
TRUE_M2 = 0.05
"""Difference between reported and true patches."""


class Met(NamedTuple):
    """Outcome of one job among things.

    Attributes:
        things: Number of things.
        reason: Why it has ended before its end; "" if it has not.
        contacts: Contacts, as in a report.
        done, left_out: Work by a raster of the truth, and what the report says is left out (m or m²).
        untrue: True if report and raster differ about what is left out.
        time_s, alone_s: Time taken, and that with nothing in the way.
        drives: Number of drives.
    """

    things: int
    reason: str
    contacts: Sequence[Mapping[str, Any]]
    done: float
    left_out: float
    untrue: bool
    time_s: float
    alone_s: float
    drives: int


Run = Callable[[int], Met]
"""Runs a job with a seed."""


def job_named(name: str) -> Run:
    """Prepare a job: "goals", "penalty-area" (of `soccer-7`), "small-pan", or the name of a template."""
    if name == "goals":
        return _to_goal
    small = name in SMALL_JOBS
    template = SMALL_JOBS[name]() if small else load_template(name)
    job = Job.prepare(template, PlanOptions(), _vehicle("clay-roller" if template.areas else "turf-tank-two"))
    alone_s = simulate(job, Scenario(seed=1)).report.total_time_s
    box = _box(template, SMALL_BEYOND_M if small else BEYOND_M)
    return lambda seed: _met(job, seed, box, alone_s)


def _penalty_area() -> Template:
    whole = load_template("soccer-7")
    return whole.model_copy(update={"segments": tuple(each for each in whole.segments if "area-west" in each.id)})


SMALL_JOBS: Mapping[str, Callable[[], Template]] = {
    "penalty-area": _penalty_area,
    "small-pan": lambda: load_template("salt-pan", {"length": 20.0, "width": 15.0}),
}


def _vehicle(name: str) -> Vehicle:
    """Return a vehicle with a lidar, and a bumper that nobody presses who runs into it: that would end the job."""
    vehicle = with_lidar(load_vehicle(name))
    strip = BumperStripSpec(name="nose", from_m=0.0, to_m=0.1, least_n=HARDEST_N)
    return vehicle.model_copy(update={"sensors": (*vehicle.sensors, strip)})


def _met(job: Job, seed: int, box: Box, alone_s: float) -> Met:
    _, start = lines_and_start(job.trajectory, job.template, job.vehicle, ())
    things = random_things(np.random.default_rng(seed), box, start[:2])
    emulator = Emulator(job.vehicle, Scenario(seed=seed, objects=things))
    outcome = simulate_job(job, emulator, Products(strokes=True))
    figures, area = outcome.figures(job), outcome.area
    strokes = outcome.strokes
    if area is None:
        gaps = figures.get("gaps", {"total_m": 0.0, "stretches": []})
        done, left_out = painted_m(job.template, strokes), gaps["total_m"]
        untrue = untrue_m(job.template, gaps["stretches"], strokes) > TRUE_M
    else:
        patches = [each["outline_m"] for each in figures.get("uncovered", {"patches": []})["patches"]]
        covered = covered_cells(job.template, strokes)
        done, left_out = covered.size_m2, area.missed_m2
        untrue = untrue_m2(covered, patches) > TRUE_M2
    return Met(
        len(things),
        figures["reason"],
        figures.get("contacts", {"each": []})["each"],
        done,
        left_out,
        untrue,
        figures["traversal"]["total_time_s"],
        alone_s,
        len(figures.get("drives", [1])),
    )


def _to_goal(seed: int) -> Met:
    rng = np.random.default_rng(seed)
    far_m, bearing, heading = rng.uniform(*GOAL_M), rng.uniform(-math.pi, math.pi), rng.uniform(-math.pi, math.pi)
    x, y = far_m * math.cos(bearing), far_m * math.sin(bearing)
    beyond_m = SMALL_BEYOND_M
    box = min(x, 0.0) - beyond_m, min(y, 0.0) - beyond_m, max(x, 0.0) + beyond_m, max(y, 0.0) + beyond_m
    things = random_things(rng, box, (0.0, 0.0))
    scenario = Scenario(seed=seed, objects=things, start=Pose2(x_m=0.0, y_m=0.0, heading_rad=0.0))
    goal = PoseGoal(x_m=x, y_m=y, heading_rad=heading)
    setup = Setup(vehicle=_vehicle("turf-tank-two"), scenario=scenario)
    drive = drive_to_goal(setup, goal, PlanOptions(), Products())
    times, drives = drive.figures()["arrival"]["time_s"], (*drive.outcome.earlier, drive.outcome)
    contacts = [
        {"thing": each.thing, "robot_mps": each.robot_mps, "time_s": each.stamp.seconds}
        for ended in drives
        if ended.contacts is not None
        for each in ended.contacts.contacts
    ]
    reached = not drive.problem
    return Met(
        len(things),
        drive.problem,
        contacts,
        float(reached),
        float(not reached),
        reached and drive.true.off_m(goal) > ARRIVED_M,
        times["taken"],
        times["planned"],
        len(drives),
    )


def _box(template: Template, beyond_m: float) -> Box:
    lines = [np.column_stack(segment.curve().at([0.0, segment.curve().length_m])[:2]) for segment in template.segments]
    points = np.concatenate([*lines, *(np.array(area.outline) for area in template.areas)])
    low, high = points.min(axis=0) - beyond_m, points.max(axis=0) + beyond_m
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])
