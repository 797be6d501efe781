"""Calibration of a robot from a recording: its constants, what speaks against each, and the noise beside them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from touchline.checking.calibrating.constants_fit import Fit, fit_constants
from touchline.checking.calibrating.drive_motion import DriveMotion, motion_of, moving_ticks
from touchline.checking.calibrating.noises import FIXES_WANDER, ROBOT_WANDERS, NoiseFit, best_noise, with_changes
from touchline.checking.calibrating.robot_constants import (
    GYRO_SCALE,
    STAMP_OFFSET,
    Constant,
    changed,
    constants_of,
    recorded,
    with_sigmas,
)
from touchline.checking.estimating.estimator_inputs import EstimatorInputs
from touchline.checking.estimating.estimator_run import EstimatorRun
from touchline.checking.estimating.innovation_tests import fixes_whiteness
from touchline.checking.estimating.revisits import Revisits, revisits
from touchline.onboard.estimation.learned_constants import SLIPPING
from touchline.schemas.onboard import Calibrated
from touchline.schemas.setup import Setup

_KNOWN: Final = 0.5
"""Share of its σ at the start that a known constant's is at most."""
_ALIKE: Final = 0.9
"""Correlation from which two constants cannot be told apart."""
_AGREE: Final = 3.0
"""σ within which both halves of a recording agree."""
_BELIEVED: Final = 5.0
"""σ at the start within which a change is believed."""
_DIFFERS: Final = 3.0
"""σ, floors included, from which a constant differs from the file for certain."""
_ROUGHLY: Final = 3.0
"""Factor on σ if a noise beyond the files' is in the recording, which the filter models only roughly. Without it gyro
scales found in emulated drives with a wandering crab angle err by up to 5 σ."""


_ONE_PASS: Final = frozenset((FIXES_WANDER, ROBOT_WANDERS))
"""Noises that one pass cannot tell from fixes that are bent at a place."""


class ConstantFinding(NamedTuple):
    """Constant as a recording tells it.

    Attributes:
        constant: The constant.
        in_file: Value in the robot's files.
        change: Change that fits best.
        sigma: Its standard deviation.
        against: Why it cannot be believed; empty if it can.
    """

    constant: Constant
    in_file: float
    change: float
    sigma: float
    against: str

    @property
    def differs(self) -> bool:
        """True if it differs from the file for certain."""
        return not self.against and abs(self.change) > _DIFFERS * self.sigma


class UnkeptFigure(NamedTuple):
    """Figure of the robot that no file keeps.

    Attributes:
        name: Name for people.
        value: Value; NaN if the recording does not tell it.
        sigma: Its standard deviation.
        unit: Unit of both.
        remark: Why it is not kept, or not told.
    """

    name: str
    value: float
    sigma: float
    unit: str
    remark: str


class Calibration(NamedTuple):
    """Result of a calibration.

    Attributes:
        findings: What the recording tells of each constant.
        beside: Figures that no file keeps.
        noise: Noise that explains it best.
        passes: Comparison of passes over the same places.
        motion: Motion of the robot.
        doubts: What speaks against all of it.
        setup: Setup with the constants that are believed.
    """

    findings: tuple[ConstantFinding, ...]
    beside: tuple[UnkeptFigure, ...]
    noise: NoiseFit
    passes: Revisits
    motion: DriveMotion
    doubts: tuple[str, ...]
    setup: Setup

    @property
    def believed(self) -> bool:
        """True if constants may be taken over."""
        return not self.doubts and any(not finding.against for finding in self.findings)

    @property
    def causes(self) -> tuple[str, ...]:
        """Names of what the files are wrong about for certain: constants, and a noise that no other one comes near."""
        constants = () if self.doubts else tuple(each.constant.name for each in self.findings if each.differs)
        if self.passes.bent:
            return ("the fixes are bent",)
        return (*constants, self.noise.name) if self.noise.name and self.noise.told else constants

    @property
    def not_told(self) -> str:
        """Sentence about what the drive cannot tell of the noise; empty if there is none."""
        if self.noise.name not in _ONE_PASS or self.passes.told:
            return ""
        return (
            "whether the robot wanders, the receiver does, or the fixes are bent at a place cannot be told by one "
            "pass: drive the same way again after half a minute"
        )

    def as_json(self) -> dict[str, Any]:
        """Return the result as a JSON object; a constant that is not believed has no number."""
        return {
            "constants": [
                {
                    "name": finding.constant.name,
                    "field": finding.constant.in_file(),
                    "unit": finding.constant.unit,
                    "in_file": finding.in_file,
                    "found": None if finding.against else finding.in_file + finding.change,
                    "sigma": None if finding.against else finding.sigma,
                    "against": finding.against,
                }
                for finding in self.findings
            ],
            "beside": [
                {
                    "name": each.name,
                    "unit": each.unit,
                    "found": each.value if math.isfinite(each.value) else None,
                    "sigma": each.sigma if math.isfinite(each.value) else None,
                    "remark": each.remark,
                }
                for each in self.beside
            ],
            "noise": {
                "larger_than_told": self.noise.name or None,
                "told_apart": self.noise.told if self.noise.name else None,
                "advantage": self.noise.better,
                "runner_up": self.noise.runner_up[0],
                "onboard": {name: dict(values) for name, values in self.noise.changes.items()},
                "not_told": self.not_told,
            },
            "causes": list(self.causes),
            "revisits": self.passes.as_json(),
            "motion": self.motion._asdict(),
            "doubts": list(self.doubts),
        }


def calibrate(path: Path, robot: str | None, progress: Callable[[float], None] = lambda done: None) -> Calibration:
    """Return the constants of a robot by a recording of a drive.

    Args:
        path: The recording.
        robot: Namespace of the robot, if there are several.
        progress: Called with the fraction done.

    Raises:
        RecordingError: The recording cannot be read.
        SpecError: It has no session of that robot, too few fixes, wheels without a sign, or a mapping that does not
            fit.
        NotRebuilt: It has no sensor frames.
    """
    inputs = EstimatorInputs(path, robot)
    inputs.require_fit()
    constants = constants_of(inputs.setup)
    fit = fit_constants(inputs, inputs.setup, constants, lambda done: progress(0.5 * done))
    certain = with_sigmas(inputs.setup, dict.fromkeys(constants, 0.0))
    noise = best_noise(inputs, _with_found(certain, constants, fit), inputs.frames)
    if noise.name:  # constants are as certain as the noise that they have been found in allows
        onboard = with_changes(inputs.setup.onboard, noise.changes)
        fit = fit_constants(
            inputs,
            inputs.setup.model_copy(update={"onboard": onboard}),
            constants,
            lambda done: progress(0.5 + 0.5 * done),
        )
        certain = certain.model_copy(update={"onboard": with_changes(certain.onboard, noise.changes)})
    passes = revisits(inputs, _with_found(certain, constants, fit))
    progress(1.0)
    motion = motion_of(fit.run)
    findings = _findings(inputs.setup, constants, fit, motion, _ROUGHLY if noise.name else 1.0)
    doubts = tuple(_doubts(fit, noise, passes))
    believed = [each for each in findings if not each.against and not doubts]
    setup = changed(inputs.setup, {each.constant: each.change for each in believed})
    sigmas = {each.constant: each.sigma for each in believed}
    by = Calibrated(day=_day(inputs, path), log=path.name)
    setup = recorded(with_sigmas(setup, sigmas), sigmas, by)
    return Calibration(findings, _beside(inputs.setup, fit.run), noise, passes, motion, doubts, setup)


def _beside(setup: Setup, run: EstimatorRun) -> tuple[UnkeptFigure, ...]:
    bias_mps2, sigma_mps2 = run.side_bias_mps2
    told = sigma_mps2 <= _KNOWN * setup.onboard.imu.accel_turn_on_bias_mps2
    again = "not kept: it is another one after each switch-on"
    bias = UnkeptFigure(
        "accelerometer bias left",
        bias_mps2 if told else math.nan,
        sigma_mps2,
        "m/s²",
        again if told else "this drive does not tell it from the slope: turn by at least 180°",
    )
    paint = "no sensor sees the paint: measure a painted line"
    return (bias, UnkeptFigure("nozzle offset", math.nan, math.nan, "m", f"no drive tells it: {paint}"))


def _day(inputs: EstimatorInputs, path: Path) -> date:
    """Return the day of a recording: as it says, or that of its file."""
    if inputs.begun is not None:
        return datetime.fromisoformat(inputs.begun).date()
    return datetime.fromtimestamp(path.stat().st_mtime, UTC).date()


def _with_found(setup: Setup, constants: Sequence[Constant], fit: Fit) -> Setup:
    return changed(setup, dict(zip(constants, fit.changes.tolist(), strict=True)))


def _findings(
    setup: Setup, constants: Sequence[Constant], fit: Fit, motion: DriveMotion, roughly: float
) -> tuple[ConstantFinding, ...]:
    sigmas = roughly * np.sqrt(np.diag(fit.covariance))
    correlation = roughly**2 * fit.covariance / np.outer(sigmas, sigmas)
    found = []
    for index, constant in enumerate(constants):
        sigma, change = float(sigmas[index]), float(fit.changes[index])
        halves, halves_sigma = fit.halves[:, index], np.maximum(roughly * fit.halves_sigma[:, index], constant.floor)
        alike = [other.name for j, other in enumerate(constants) if j != index and abs(correlation[index, j]) > _ALIKE]
        missing = [str(getattr(motion, need)) for need in constant.needs if getattr(motion, need)]
        against = ""
        if missing:
            against = f"this drive does not tell it: {' and '.join(missing)}"
        elif alike:
            against = f"this drive does not tell it from {' and '.join(alike)}"
        elif sigma > _KNOWN * constant.start_sigma:
            against = "this drive hardly tells it: drive for longer, with more turns and stops"
        elif abs(change) > min(_BELIEVED * constant.start_sigma, constant.most):
            against = "it would be too far from what the file says: is the file of this robot?"
        elif abs(halves[0] - halves[1]) > _AGREE * math.hypot(*halves_sigma):
            against = "both halves of the drive contradict each other"
        found.append(ConstantFinding(constant, constant.of(setup), change, max(sigma, constant.floor), against))
    return tuple(found)


def _doubts(fit: Fit, noise: NoiseFit, passes: Revisits) -> list[str]:
    doubts = [f"{passes.words}: calibrate elsewhere"] if passes.bent else []
    if not fit.converged:
        doubts.append("no constants fit the recording: the search for them does not end")
    correlation = fixes_whiteness(fit.run.white[moving_ticks(fit.run)], fit.run.fix_lag)
    # A filter that follows a burst overshoots after it: a negative correlation does not make σ too small.
    if correlation is not None and correlation.found and correlation.correlation > 0.0:
        explained = f"; {noise.name} more than the files say" if noise.name else ""
        doubts.append(
            f"with the best constants the innovations of fixes still are correlated by {correlation.correlation:.2f}, "
            f"chance explains {correlation.by_chance:.2f}{explained}"
        )
    counted = fit.run.consistency
    if counted.encoders_rejected > SLIPPING * fit.run.wheel_readings:
        share = 100.0 * counted.encoders_rejected / fit.run.wheel_readings
        doubts.append(
            f"the wheels slip ({share:.1f} % of their readings are rejected), which looks like {GYRO_SCALE.name}, "
            f"antenna and {STAMP_OFFSET.name}: calibrate on dry ground"
        )
    return doubts
