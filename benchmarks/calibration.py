"""Constants that `touchline calibrate` finds, on emulated jobs whose files are wrong by known amounts.

`python -m benchmarks calibration`: each of `seeds` jobs of `template` is recorded once, and calibrated for each row.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks._settings import Small
from touchline.checking.calibrating import robot_constants as c
from touchline.checking.calibrating.constants_fit import fit_constants
from touchline.checking.calibrating.noises import best_noise
from touchline.checking.estimating.estimator_inputs import EstimatorInputs
from touchline.checking.estimating.estimator_run import EstimatorRun, rerun
from touchline.checking.estimating.innovation_tests import fixes_whiteness

WRONG: Final[Mapping[str, Mapping[c.Constant, float]]] = {
    "nothing": {},
    "gyro scale 1 %": {c.GYRO_SCALE: 0.01},
    "antenna 3 cm, 3 cm": {c.ANTENNA_X: 0.03, c.ANTENNA_Y: 0.03},
    "stamps 30 ms late": {c.STAMP_OFFSET: -0.03},
    "0.5 %, 1 cm, -1 cm, 30 ms": {c.GYRO_SCALE: 0.005, c.ANTENNA_X: 0.01, c.ANTENNA_Y: -0.01, c.STAMP_OFFSET: 0.03},
}
SHOWN: Final = (c.GYRO_SCALE, c.ANTENNA_X, c.ANTENNA_Y, c.STAMP_OFFSET, c.TRACK, c.SIDE_SLIP)
SMALL = Small(
    {"seeds": 1, "template": "study-square"},
    ("nothing: within 2 sigma # of #", "correlation before # after #", "calibration # s"),
)


def recorded(template: str, seed: int, folder: Path) -> Path:
    """Record the job with one seed."""
    path = folder / f"{seed}.mcap"
    command = [sys.executable, "-m", "touchline", "simulate", template, "--seed", str(seed), "--record", str(path)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return path


def main(seeds: int = 20, template: str = "tennis") -> None:
    """Print what is found, beside what the files are wrong by."""
    with tempfile.TemporaryDirectory() as folder:
        paths = [recorded(template, seed, Path(folder)) for seed in range(1, seeds + 1)]
        for name, wrong in WRONG.items():
            _row(name, wrong, paths)


def _row(name: str, wrong: Mapping[c.Constant, float], paths: list[Path]) -> None:
    errors, sigmas, before, after, named = [], [], [], [], []
    begun_s = time.process_time()
    for path in paths:
        inputs = EstimatorInputs(path, None)
        inputs.setup = c.with_sigmas(c.changed(inputs.setup, wrong), dict.fromkeys(SHOWN, 0.0))
        fit = fit_constants(inputs, inputs.setup, SHOWN)
        errors.append(fit.changes + [wrong.get(each, 0.0) for each in SHOWN])
        floors = [each.floor for each in SHOWN]
        sigmas.append(np.maximum(np.sqrt(np.diag(fit.covariance)), floors))
        before.append(_correlation(rerun(inputs, inputs.setup, inputs.frames)))
        after.append(_correlation(fit.run))
        named.append(_noise(inputs, fit.changes))
    took_s = (time.process_time() - begun_s) / len(paths)
    error, z = np.array(errors), np.array(errors) / np.array(sigmas)
    within = (np.abs(z) < 2.0).sum(axis=0)
    print(f"{name}: within 2 sigma {min(within)} of {len(paths)}")
    for index, constant in enumerate(SHOWN):
        print(
            f"  {constant.name}: off by {error[:, index].mean():.5f} +- {error[:, index].std():.5f} {constant.unit}, "
            f"sigma {np.array(sigmas)[:, index].mean():.5f}, within 2 sigma {within[index]} of {len(paths)}"
        )
    noises = {each or "none": named.count(each) for each in sorted(set(named))}
    print(f"  correlation before {np.mean(before):.2f} after {np.mean(after):.2f}, noise named {noises}")
    print(f"  calibration {took_s:.1f} s of processor time")


def _correlation(run: EstimatorRun) -> float:
    found = fixes_whiteness(run.white, run.fix_lag)
    return found.correlation if found is not None else float("nan")


def _noise(inputs: EstimatorInputs, changes: np.ndarray) -> str:
    best = c.changed(inputs.setup, dict(zip(SHOWN, changes.tolist(), strict=True)))
    return best_noise(inputs, best, inputs.frames).name
