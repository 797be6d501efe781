"""Fit of a scenario to a recording or an imported log."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from touchline.checking.estimating.estimator_inputs import EstimatorInputs
from touchline.checking.reality.log_samples import LogSamples, samples_of
from touchline.checking.reality.scenario_fit import ScenarioFit, fit_scenario
from touchline.checking.recorded_session import NotRebuilt
from touchline.schemas.errors import SpecError
from touchline.schemas.scenario import Scenario


def fit_log(
    path: Path, robot: str | None = None, progress: Callable[[float], None] = lambda done: None
) -> tuple[LogSamples, ScenarioFit]:
    """Return a log's samples, and the scenario that errs as they do.

    Of the session's own scenario only the origin is taken over.

    Args:
        path: Recording or imported log.
        robot: Namespace of the robot, if there are several.
        progress: Called with the fraction done.

    Raises:
        RecordingError: The recording cannot be read.
        SpecError: It has no session of that robot, or of one without GNSS, two wheels or sensors, its wheels
            have no sign, or its mapping does not fit.
    """
    inputs = EstimatorInputs(path, robot)
    try:
        inputs.require_fit()
        log = samples_of(inputs)
    except NotRebuilt as error:
        raise SpecError(str(path), "", str(error), "record the sensors of the whole drive") from error
    name = f"as {path.stem}"[:40]
    scenario = Scenario(name=name, origin=inputs.setup.scenario.origin)
    return log, fit_scenario(log, scenario, inputs.setup.onboard, progress)
