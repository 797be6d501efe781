"""Constants that the calibration drive alone tells, of emulated robots that are not as their files say.

`python -m benchmarks calibration_drive`: each of `seeds` robots does the drive on `surface`, and is calibrated by it.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks._settings import Small
from touchline.checking.calibrating.drive_calibration import Calibration, calibrate
from touchline.jobs.calibration.calibration_simulation import drive_to_calibrate
from touchline.schemas.scenario import Ground, Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.truth import Truth
from touchline.services.planner.calibration_drive import plan_calibration

TRUE: Final = {"gyro scale": 0.005, "antenna forward": 0.01, "antenna left": -0.01, "stamp offset": -0.03}
_TRUTH: Final = Truth(gyro_scale_relative=0.005, antenna_x_m=0.01, antenna_y_m=-0.01, stamp_offset_s=0.03)
SMALL = Small({"seeds": 1}, ("gyro scale: told # of #, within 2 sigma #",))


def main(seeds: int = 20, surface: str = "grass") -> None:
    """Print what the drives tell, beside the truth."""
    with tempfile.TemporaryDirectory() as folder:
        found = [_calibrated(seed, surface, Path(folder)) for seed in range(1, seeds + 1)]
    for index, (name, true) in enumerate(TRUE.items()):
        told = [each.findings[index] for each in found if not each.doubts and not each.findings[index].against]
        error = np.array([each.change - true for each in told])
        sigma = np.array([each.sigma for each in told])
        within = int((np.abs(error) < 2.0 * sigma).sum())
        print(f"{name}: told {len(told)} of {seeds}, within 2 sigma {within}", end="")
        print(f", off by {error.mean():.5f} +- {error.std():.5f}, sigma {sigma.mean():.5f}" if told else "")


def _calibrated(seed: int, surface: str, folder: Path) -> Calibration:
    ground = Ground.model_validate({"surface": surface})
    setup = Setup(scenario=Scenario(seed=seed, truth=_TRUTH, ground=ground))
    path = folder / f"{seed}.mcap"
    outcome = drive_to_calibrate(setup, plan_calibration(setup.vehicle), path)
    found = calibrate(path, None)
    doubts = "; ".join(found.doubts) or "none"
    print(f"seed {seed}: {outcome.report.total_time_s:.0f} s, noise {found.noise.name or 'none'}, doubts: {doubts}")
    for each in found.findings[: len(TRUE)]:
        told = each.against or f"{each.change:.5f} +- {each.sigma:.5f}"
        print(f"  {each.constant.name}: {told}", flush=True)
    return found
