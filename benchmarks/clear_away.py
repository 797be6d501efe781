"""A person on a line who stays, or goes away: the reported gap, and the joints of the paint where there is none.

`python -m benchmarks clear_away`; `runs` jobs of each kind, with default noise: two lines of 12 m, 4 m apart, and a
person on the first. One stays, one goes while the robot waits, and one after it has gone round, so that it comes back
for the rest. A reported gap is compared with the raster of the true paint; joints are those of true strokes, as by
`python -m benchmarks joints`, whose limits after a pause hold here, too. Ends with exit code 1 after a contact, if a
gap is off by more than 2 cm, or if a joint is beyond its limits.
"""

import sys
from typing import Any, Final, NamedTuple

import numpy as np

from benchmarks._joints import Joint, full_strokes, joints_along
from benchmarks._settings import Small
from benchmarks._true_paint import TRUE_M, untrue_m
from benchmarks.joints import MAX_DOUBLE_M, MAX_GAP_M
from touchline.jobs.single.simulation import Job, Products
from touchline.jobs.way_round.drives_report import gap_figures
from touchline.jobs.way_round.way_round_simulation import WayRoundDrives, simulate_way_round
from touchline.schemas.catalogue import load_vehicle
from touchline.schemas.messages import PlanOptions
from touchline.schemas.scenario import Scenario
from touchline.schemas.template import Template
from touchline.services.robot_sim.emulator import Emulator

VEHICLE: Final = "examples/vehicles/marker-lidar.json"
FIELD: Final = Template.model_validate(
    {
        "name": "two lines",
        "segments": [
            {"id": "first", "line": {"start": (0.0, 0.0), "end": (12.0, 0.0)}},
            {"id": "second", "line": {"start": (12.0, 4.0), "end": (0.0, 4.0)}},
        ],
    }
)
STAYS, WAITED_FOR, COME_BACK = "stays", "goes while waited for", "goes later"
LEAVES_S: Final = {WAITED_FOR: (8.0, 12.0), COME_BACK: (22.0, 32.0)}
"""Times at which the person goes: while the robot stands there, or after it has gone round."""
AWAY_M: Final = -12.0
SMALL = Small(
    {"runs": 1},
    (
        "stays 1 jobs, # drives: # m left out, untrue by at most # m",
        "goes while waited for 1 jobs, # drives: # m left out, untrue by at most # m",
        "goes later 1 jobs, # drives: # m left out, untrue by at most # m",
        "# joints, open by # mm (mean), # mm (worst), twice by # mm, # mm; # beyond # mm open or # mm twice",
    ),
)


class Away(NamedTuple):
    """Outcome of a job with a person on its first line."""

    drives: int
    contacts: int
    left_out_m: float
    untrue_m: float
    joints: list[Joint]


def main(runs: int = 20, seed: int = 1) -> None:
    """Run the jobs, and print the figures of each kind."""
    job, bad = Job.prepare(FIELD, PlanOptions(), load_vehicle(VEHICLE)), 0
    for kind in (STAYS, WAITED_FOR, COME_BACK):
        rows = [_run(kind, job, number) for number in range(seed, seed + runs)]
        bad += _print(kind, rows)
    if bad:
        sys.exit(f"{bad} not as required")


def _run(kind: str, job: Job, seed: int) -> Away:
    rng = np.random.default_rng(seed)
    x, y = float(rng.uniform(5.0, 7.0)), float(rng.uniform(-0.2, 0.2))
    person: dict[str, Any] = {"kind": "person", "x_m": x, "y_m": y}
    if kind in LEAVES_S:
        start_s = float(rng.uniform(*LEAVES_S[kind]))
        person["motion"] = {"kind": "path", "points": [(x, AWAY_M)], "start_s": start_s}
    emulator = Emulator(job.vehicle, Scenario.model_validate({"seed": seed, "objects": [person]}))
    drives = WayRoundDrives(emulator, job)
    outcome = simulate_way_round(job, emulator, Products(strokes=True), drives=drives)
    figures, gaps = outcome.figures(job), gap_figures(drives.way_round.left_out.stretches)
    if figures["reason"]:
        raise SystemExit(f"{kind}, seed {seed}: {figures['reason']}")
    contacts = figures.get("contacts", {"while_moving": 0, "at_rest": 0})
    return Away(
        len(outcome.drives),
        contacts["while_moving"] + contacts["at_rest"],
        gaps["total_m"],
        untrue_m(job.template, gaps["stretches"], outcome.strokes),
        _joints(drives) if kind != STAYS else [],
    )


def _joints(drives: WayRoundDrives) -> list[Joint]:
    """Joints of the first line, on which the person stood."""
    strokes = full_strokes(*(work.ledger for work in drives.works))
    curves = [FIELD.segments[0].curve()]
    return joints_along(curves, [points for points in strokes if np.ptp(points[:, 1]) < 1.0 and points[0, 1] < 1.0])


def _print(kind: str, rows: list[Away]) -> int:
    """Print the figures of a kind; return how many of its jobs and joints are not as required."""
    untrue = [row.untrue_m for row in rows]
    print(f"{kind:22} {len(rows):3} jobs, {sum(row.drives for row in rows):3} drives: ", end="")
    print(
        f"{np.mean([row.left_out_m for row in rows]):.2f} m left out, untrue by at most {max(untrue):.3f} m, ", end=""
    )
    print(f"{sum(row.contacts for row in rows)} contacts", flush=True)
    bad = sum(each > TRUE_M for each in untrue) + sum(row.contacts > 0 for row in rows)
    found = np.array([joint for row in rows for joint in row.joints]).reshape(-1, 2)
    if len(found):
        beyond = int(np.count_nonzero((found[:, 0] > MAX_GAP_M) | (found[:, 1] > MAX_DOUBLE_M)))
        (gap, double), (worst_gap, worst_double) = 1e3 * found.mean(axis=0), 1e3 * found.max(axis=0)
        print(f"    {len(found)} joints, open by {gap:.1f} mm (mean), {worst_gap:.1f} mm (worst), ", end="")
        print(f"twice by {double:.1f} mm, {worst_double:.1f} mm; {beyond} beyond ", end="")
        print(f"{1e3 * MAX_GAP_M:.0f} mm open or {1e3 * MAX_DOUBLE_M:.0f} mm twice", flush=True)
        bad += beyond
    return bad
