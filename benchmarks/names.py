"""Causes named: random single mismatches of kinds that one pass can tell, and what is said of each.

`python -m benchmarks names`: each of `jobs` draws a kind and a size, and is driven and recorded. `robot` is what the
robot has said under way (`files-differ`), `calibrate` the causes that `touchline calibrate` names in the recording.
Each emulated robot has a track width and a side slip of its own; to name these is not wrong. *nothing* has right
files, *bent* is multipath, which only passes over the same place tell; both are run only if `kinds` says so.
"""

from __future__ import annotations

import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from benchmarks._settings import Small
from touchline.checking.calibrating.drive_calibration import calibrate
from touchline.checking.calibrating.robot_constants import SIDE_SLIP, TRACK
from touchline.jobs.single.simulation import Job, Products, simulate
from touchline.onboard.estimation.learned_constants import NAMES
from touchline.recordings.channels import topic_at
from touchline.recordings.reader import RecordingReader
from touchline.schemas import topics
from touchline.schemas.catalogue import load_template
from touchline.schemas.cdr import decode
from touchline.schemas.messages import Event, PlanOptions
from touchline.schemas.scenario import DriveNoise, GnssNoise, Multipath, Scenario
from touchline.schemas.truth import Truth

SMALL = Small(
    {"jobs": 1, "kinds": "stamp offset", "template": "study-square"},
    ("calibrate: # of 1 right, # wrong, # not told", "robot: # of 1 right, # wrong, # not told"),
)
SCALE, FORWARD, LEFT, STAMPS = NAMES
OF_THE_SEED: Final = (TRACK.name, SIDE_SLIP.name)

Parts = dict[str, Any]
Draw = Callable[[np.random.Generator], Parts]


class Kind(NamedTuple):
    """Kind of mismatch.

    Attributes:
        name: What is right to say of it; empty: nothing.
        parts: Draws the parts of a scenario that have it.
    """

    name: str
    parts: Draw


def _truth(field: str, least: float, most: float, *, signed: bool = True) -> Draw:
    def draw(rng: np.random.Generator) -> Parts:
        size = rng.uniform(least, most) * (rng.choice((-1.0, 1.0)) if signed else 1.0)
        return {"truth": Truth.model_validate({field: float(size)})}

    return draw


def _bent(rng: np.random.Generator) -> Parts:
    around = ((-200.0, -200.0), (200.0, -200.0), (200.0, 200.0), (-200.0, 200.0))
    return {"multipath": (Multipath(outline=around, error_m=0.03),)}


ONE_PASS: Final = {
    "scale": Kind(SCALE, _truth("gyro_scale_relative", 0.003, 0.015)),
    "forward": Kind(FORWARD, _truth("antenna_x_m", 0.01, 0.04)),
    "left": Kind(LEFT, _truth("antenna_y_m", 0.01, 0.04)),
    "stamp offset": Kind(STAMPS, _truth("stamp_offset_s", 0.01, 0.05)),
    "white": Kind("fixes scatter", lambda rng: {"gnss": GnssNoise(white_m=float(rng.uniform(0.012, 0.02)))}),
    "correlated": Kind(
        "fixes wander",
        lambda rng: {"gnss": GnssNoise(gauss_markov_2_m=float(rng.uniform(0.012, 0.03)), gauss_markov_2_tau_s=5.0)},
    ),
    "wander": Kind("the robot wanders sideways", _truth("wander_rad", 0.015, 0.04, signed=False)),
    "slip": Kind("wheels slip", lambda rng: {"drive": DriveNoise(slip_relative=float(rng.uniform(0.06, 0.12)))}),
}
OTHERS: Final = {"nothing": Kind("", lambda rng: {}), "bent": Kind("the fixes are bent", _bent)}


class Said(NamedTuple):
    """Causes that are named after a job: by the robot, and by a calibration."""

    robot: tuple[str, ...]
    calibrate: tuple[str, ...]


def ask(job: Job, scenario: Scenario, path: Path) -> Said:
    """Drive a job, and return what is said of it."""
    simulate(job, scenario, products=Products(record=path))
    events = (
        decode(Event, each.payload)
        for each in RecordingReader(path).messages()
        if topic_at(each.topic) == topics.EVENTS
    )
    differing = [event.text.partition(" differs ")[0] for event in events if event.code == "files-differ"]
    found = (cause for cause in calibrate(path, None).causes if cause not in OF_THE_SEED)
    return Said(tuple(text.rpartition(": ")[2] for text in differing), tuple(found))


def line(who: str, kind: Kind, said: list[tuple[str, ...]]) -> str:
    """Lay out how often a kind was named rightly, wrongly or not at all."""
    right = sum(causes == ((kind.name,) if kind.name else ()) for causes in said)
    silent = sum(not causes for causes in said) if kind.name else 0
    others = Counter(", ".join(causes) for causes in said if causes and causes != (kind.name,))
    heard = "; ".join(f"{causes} ({count})" for causes, count in others.most_common())
    wrong = len(said) - right - silent
    return f"  {who}: {right} of {len(said)} right, {wrong} wrong, {silent} not told  {heard}"


def main(jobs: int = 300, kinds: str = "", template: str = "tennis", first: int = 1) -> None:
    """Draw `jobs` mismatches of the `kinds` whose names have these words, by turns; all that one pass can tell."""
    job = Job.prepare(load_template(template), PlanOptions())
    chosen = [name for name in (ONE_PASS | OTHERS if kinds else ONE_PASS) if kinds in name]
    heard: dict[str, list[Said]] = {name: [] for name in chosen}
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, first + jobs):
            name = chosen[seed % len(chosen)]
            parts = (ONE_PASS | OTHERS)[name].parts(np.random.default_rng(seed))
            heard[name].append(ask(job, Scenario(seed=seed, **parts), Path(folder) / "job.mcap"))
    for name, said in heard.items():
        if said:
            kind = (ONE_PASS | OTHERS)[name]
            print(f"{name}:")
            print(line("robot", kind, [each.robot for each in said]))
            print(line("calibrate", kind, [each.calibrate for each in said]))
