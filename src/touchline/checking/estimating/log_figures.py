"""All figures of the estimator on one recording: consistency, errors, withheld outages, and the batch reference."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from touchline.checking.estimating.estimate_figures import estimate_figures
from touchline.checking.estimating.estimator_inputs import EstimatorInputs
from touchline.checking.estimating.estimator_run import EstimatorRun, run_inputs
from touchline.checking.estimating.outages import outages
from touchline.checking.estimating.receiver_figures import receiver_figures
from touchline.checking.estimating.reference_frame import FrameFit
from touchline.checking.estimating.smoother import distance_in_sigma, smoothed
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.setup import Setup
from touchline.schemas.spec import parse, read_text
from touchline.schemas.vehicles import GNSS


def with_onboard(setup: Setup, path: Path) -> Setup:
    """Return a setup in which a file's values replace those of the computer's configuration.

    Args:
        setup: The setup.
        path: JSON file; what it leaves out stays.

    Raises:
        SpecError: The file cannot be read, or is no such configuration.
    """
    given = parse(OnboardConfig, read_text(path), path.name).model_dump(exclude_unset=True)
    values = setup.onboard.model_dump()
    for name, value in given.items():
        values[name] = values[name] | value if isinstance(value, dict) else value
    return setup.model_copy(update={"onboard": OnboardConfig.model_validate(values)})


def estimate_log(
    inputs: EstimatorInputs,
    setup: Setup,
    alignment: FrameFit = FrameFit.NONE,
    progress: Callable[[float], None] = lambda done: None,
) -> tuple[EstimatorRun, dict[str, Any]]:
    """Run the estimator on a recording, and return the run and its figures as a JSON object.

    Args:
        inputs: The recording.
        setup: Setup of the robot, the recording's or another.
        alignment: Allowed difference of the reference's frame.
        progress: Called with the fraction done.
    """
    run = run_inputs(inputs, setup, progress)
    figures = {**estimate_figures(run, alignment), "receiver": receiver_figures(run)}
    if run.starts_s and setup.vehicle.positioning == GNSS:
        figures["outages"] = {
            f"{found.length_s}_s": {
                "windows": len(found.error_m),
                "inside_3_sigma_pct": found.inside_3_sigma_pct,
                "error_median_m": float(np.median(found.error_m)),
                "sigma_median_m": float(np.median(found.sigma_m)),
            }
            for found in outages(inputs, setup)
        }
        track = smoothed(run, inputs.frames)
        figures["smoother_distance_in_sigma"] = None if track is None else distance_in_sigma(run, track)
    return run, figures
