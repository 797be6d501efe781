"""Mismatch: a robot that is not as its computer is told, one kind and size of deviation a row.

`python -m benchmarks mismatch`; `seeds` are pooled, `rows` are those whose name has these words (all by default).
Errors of the estimate are root mean squares of error over claimed σ, ten times a second while the robot moves; a job
that does not finish is given up after twice its planned time and a minute.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks._settings import Small
from touchline.schemas.catalogue import load_template
from touchline.schemas.messages import Event, Trajectory, TraversalStatus
from touchline.schemas.scenario import GnssNoise, Ground, GroundWave, Multipath, Scenario
from touchline.schemas.template import Template
from touchline.schemas.truth import Truth
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import plan
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import UNLOGGED, FastRunner
from touchline.services.robot_sim.settling import RESTING_MPS

VEHICLE = Vehicle()
LOOK_TICKS = 10
SMALL = Small({"seeds": 1, "rows": "as told"}, ("as told # mm # # # # 1 of 1",))


def _of(**figures: float) -> dict[str, Any]:
    return {"truth": Truth(**figures)}


def _around(size_m: float) -> tuple[tuple[float, float], ...]:
    return ((-size_m, -size_m), (size_m, -size_m), (size_m, size_m), (-size_m, size_m))


ROWS: dict[str, dict[str, Any]] = {
    "as told": {},
    "gyro scale 0.5 %": _of(gyro_scale_relative=0.005),
    "gyro scale 1 %": _of(gyro_scale_relative=0.01),
    "gyro leans 1°, ground C": _of(gyro_lean_x_rad=math.radians(1.0)) | {"ground": Ground(roughness="C")},
    "lever x 1 cm": _of(antenna_x_m=0.01),
    "lever x 3 cm": _of(antenna_x_m=0.03),
    "lever y 1 cm": _of(antenna_y_m=0.01),
    "lever y 3 cm": _of(antenna_y_m=0.03),
    "mast leans 1° left": _of(mast_left_rad=math.radians(1.0)),
    "stamps 30 ms late": _of(stamp_offset_s=0.03),
    "stamps 30 ms early": _of(stamp_offset_s=-0.03),
    "stamps jitter 10 ms": _of(stamp_jitter_s=0.01),
    "radius 1 %": _of(wheel_radius_relative=0.01),
    "right wheel 1 % larger": _of(wheel_difference_relative=0.01),
    "tyres 1 % by load": _of(tyre_load_relative=-0.01),
    "track 1 %": _of(track_width_relative=0.01),
    "nozzle y 1 cm": _of(nozzle_y_m=0.01),
    "hard iron 3 µT": _of(hard_iron_x_t=3e-6),
    "base 2 cm": _of(base_east_m=0.02),
    "crab 1°": _of(crab_rad=math.radians(1.0)),
    "wander 0.020 rad": _of(wander_rad=0.02),
    "slope 5 %": {"ground": Ground(grade=0.05, uphill_rad=1.0)},
    "slope 8 %": {"ground": Ground(grade=0.08, uphill_rad=1.0)},
    "wet grass": {"ground": Ground(surface="wet-grass")},
    "ground B": {"ground": Ground(roughness="B")},
    "ground C": {"ground": Ground(roughness="C")},
    "vibration 0.4 m/s²": _of(vibration_mps2=0.4),
    "patches 3 %": _of(patch_slip_relative=0.03),
    "crown 1 %": {"ground": Ground(waves=(GroundWave(rise_m=0.32, length_m=128.0),))},
    "ruts 2 cm": {"ground": Ground(waves=(GroundWave(rise_m=0.02, length_m=1.6),))},
    "wind 2 mm": _of(drift_east_m=0.002),
    "reality": {"ground": Scenario.reality().ground, "truth": Scenario.reality().truth},
    "white tail": {"gnss": GnssNoise.white_tail()},
    "bursts 10 s": {"gnss": GnssNoise(burst_s=10.0, burst_tau_s=3.0)},
    "multipath 2 cm": {"multipath": (Multipath(outline=_around(200.0)),)},
}


class Drive(NamedTuple):
    """One run: errors as (looks, 3) east, north, heading, and the figures that go with them."""

    lateral_m: NDArray[np.float64]
    errors: NDArray[np.float64]
    covariances: NDArray[np.float64]
    fix_nis: float
    finished: bool
    said: tuple[str, ...]

    @property
    def nees(self) -> float:
        """Mean of e·P⁻¹·e over the run, 3 if the claimed σ is right."""
        e = self.errors[:, :, None]
        return float((e * np.linalg.solve(self.covariances, e)).sum(axis=(1, 2)).mean())


def drive(trajectory: Trajectory, template: Template, scenario: Scenario) -> Drive:
    """Drive a job in a scenario; of what the robot warned the last words are kept, which are the cause."""
    emulator = Emulator(VEHICLE, scenario)
    limit_s = 2.0 * emulator.load(trajectory, template) + 60.0
    emulator.start()
    runner, errors, covariances, said = FastRunner(emulator), [], [], []
    while emulator.active and emulator.time_s < limit_s:
        runner.step(LOOK_TICKS, UNLOGGED)
        warnings = [each.text for each in emulator.take_events() if each.severity >= Event.WARN]
        said += [each.partition(";")[0].rpartition(": ")[2] for each in warnings]
        if abs(emulator.world.state.speed_mps) > RESTING_MPS:
            true, found = emulator.world.pose, emulator.onboard.estimate
            turn = math.remainder(found.heading_rad - true.heading_rad, math.tau)
            errors.append((found.east_m - true.east_m, found.north_m - true.north_m, turn))
            covariances.append(np.reshape(found.covariance, (3, 3)).copy())
    counters = emulator.onboard.estimator.counters
    return Drive(
        np.abs(emulator.work.ledger.deviation().lateral_m),
        np.array(errors),
        np.array(covariances),
        counters.fix_nis_sum / max(counters.fixes, 1),
        emulator.onboard.state == TraversalStatus.DONE,
        tuple(said),
    )


def _times(errors: NDArray[np.float64], variances: NDArray[np.float64]) -> float:
    """Root mean square of the errors over the claimed σ."""
    return float(np.sqrt(((errors**2).sum(axis=1) / variances).mean()))


def line(name: str, drives: list[Drive]) -> str:
    """Lay out the figures of a row, all its seeds pooled."""
    errors = np.concatenate([each.errors for each in drives])
    covariances = np.concatenate([each.covariances for each in drives])
    lateral = np.concatenate([each.lateral_m for each in drives])
    p95 = f"{np.percentile(lateral, 95) * 1e3:7.1f}" if len(lateral) else "      –"
    position = _times(errors[:, :2], covariances[:, 0, 0] + covariances[:, 1, 1])
    heading = _times(errors[:, 2:], covariances[:, 2, 2])
    said = Counter(words for each in drives for words in set(each.said))
    heard = ", ".join(f"{words} ({count})" for words, count in said.most_common()) or "nothing"
    nees, nis = (np.mean([getattr(each, figure) for each in drives]) for figure in ("nees", "fix_nis"))
    done = f"{sum(each.finished for each in drives)} of {len(drives)}"
    return f"{name:24s}{p95} mm {position:6.2f} {heading:6.2f} {nees:8.2f} {nis:7.2f}  {done:9s} {heard}"


def main(seeds: int = 12, rows: str = "", template: str = "study-square") -> None:
    """Run every row with every seed, and print its figures as soon as they are there."""
    lines = load_template(template)
    trajectory = plan(lines, VEHICLE).trajectory
    print(f"{'':24s}lateral    error / claimed σ      NEES   NIS of  finished  warnings (seeds)")
    print(f"{'':24s}    p95    position heading  (3.0)  fixes (2.0)")
    for name, parts in ROWS.items():
        if rows in name:
            drives = [drive(trajectory, lines, Scenario(seed=seed, **parts)) for seed in range(1, seeds + 1)]
            print(line(name, drives), flush=True)
