"""Scenario that errs as a log does, and the computer's configuration that knows it.

Wander, and a receiver that has rested, have a theory by which they are fitted. Slip, roughness, vibration, and the
scatter of a receiver that has not, are found by emulating the log (D. McFadden, "A method of simulated moments",
Econometrica 57(5), 1989): what they add to the variance of a statistic is scaled until the emulation has the log's.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from touchline.checking.reality import log_statistics as s
from touchline.checking.reality.emulated_log import emulated
from touchline.checking.reality.imu_statistics import biases_at_rest, native_rate_hz
from touchline.checking.reality.log_samples import LogSamples, stretches
from touchline.checking.reality.receiver_fit import fitted_receiver
from touchline.checking.reality.told import Told
from touchline.checking.reality.wander_theory import fitted_wander
from touchline.schemas.faults import GnssWrongFix
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Ground, Scenario
from touchline.schemas.truth import Truth

_RATES_HZ: Final = (1, 2, 5, 10, 20)
_RADPS_OF_C: Final = math.radians(3.4)
"""Roll rate on ground of class C at 1 m/s."""
_LEAST_MPS: Final = 0.2
_ROUNDS: Final = 2
# Figures that scenario and computer share.
_OF_RECEIVER: Final = ("white_m", "gauss_markov_1_m", "gauss_markov_1_tau_s", "gauss_markov_2_m", "rate_hz")
_OF_GYRO: Final = ("gyro_density_radps_rthz", "gyro_bias_walk_radps_rts", "gyro_temperature_radps_per_k")

Statistics = Mapping[str, Told]


class ScenarioFit(NamedTuple):
    """Scenario fitted to a log.

    Attributes:
        scenario: The scenario.
        onboard: Configuration of a computer that is told of the same errors.
        statistics: Statistics of the log.
        imu_hz: Rate of its IMU.
    """

    scenario: Scenario
    onboard: OnboardConfig
    statistics: Statistics
    imu_hz: float


def fit_scenario(
    log: LogSamples, scenario: Scenario, onboard: OnboardConfig, progress: Callable[[float], None] = lambda done: None
) -> ScenarioFit:
    """Return the scenario that errs as a log does; what the log does not tell is left as it is.

    Args:
        log: The log.
        scenario: Scenario to start from.
        onboard: Configuration of the computer to start from.
        progress: Called with the fraction done.

    Raises:
        SpecError: A figure of the log is beyond what a scenario may have.
    """
    found, imu_hz = s.log_statistics(log), native_rate_hz(log.imu[:, 2])
    fitted = _with_jumps(_with_wander(_with_gyro(_with_receiver(scenario, log, found), log, found), log, found), log)
    fitted = _with_parts(fitted, found, _first_parts(log, found, fitted))
    if any(found[key].value is not None for key in (s.SLIP, s.SCATTER, s.ROLLING, s.SHAKING)):
        for number in range(_ROUNDS):
            fitted = _closer(fitted, log, found, imu_hz)
            progress((number + 1) / _ROUNDS)
    return ScenarioFit(fitted, _told(onboard, fitted, found), found, imu_hz)


def _with_receiver(scenario: Scenario, log: LogSamples, found: Statistics) -> Scenario:
    """Fit the receiver to the differences at rest; without rest its white part to the scatter while moving."""
    if len(log.fixes) < 2:
        return scenario
    found_hz = 1.0 / float(np.median(np.diff(log.fixes[:, 0])))
    changes: dict[str, Any] = {"rate_hz": min(_RATES_HZ, key=lambda each: abs(math.log(each / found_hz)))}
    differences = {lag: found[key].value for lag, key in s.DIFFERENCE.items()}
    told = {lag: value for lag, value in differences.items() if value}
    scatter = found[s.SCATTER].value
    only = {"gauss_markov_2_m": 0.0, "burst_share": 0.0}
    if told:
        noise = fitted_receiver(told)
        changes |= only | {
            "white_m": noise.white_m,
            "gauss_markov_1_m": noise.slow_m,
            "gauss_markov_1_tau_s": noise.slow_s,
        }
    elif scatter is not None:
        changes |= only | {"white_m": scatter, "gauss_markov_1_m": 0.0}
    return scenario.replace("gnss", scenario.gnss.model_copy(update=changes))


def _with_wander(scenario: Scenario, log: LogSamples, found: Statistics) -> Scenario:
    told = {length: found[key].value for length, key in s.LATERAL.items()}
    sigmas = {length: value for length, value in told.items() if value is not None}
    if not sigmas:
        return scenario
    speed = np.abs(log.speed_mps)
    spacing_m = float(np.median(speed[speed > _LEAST_MPS])) / scenario.gnss.rate_hz
    wander = fitted_wander(sigmas, spacing_m, scenario.gnss.white_m)
    return _with_truth(scenario, wander_rad=wander.sigma_rad, wander_m=wander.length_m)


def _with_gyro(scenario: Scenario, log: LogSamples, found: Statistics) -> Scenario:
    """Take over noise and walk; the walk has the drift with the temperature in it."""
    density, walk = found[s.GYRO_NOISE].value, found[s.BIAS_WALK].value
    if density is None:
        return scenario
    biases = biases_at_rest(log.time_s, log.imu[:, 2], stretches(log.rests))
    changes = {
        "gyro_density_radps_rthz": density,
        "gyro_bias_walk_radps_rts": walk or 0.0,
        "gyro_temperature_radps_per_k": 0.0,
        "gyro_turn_on_bias_radps": float(np.sqrt(np.mean(biases[:, 1] ** 2))) if len(biases) else 0.0,
    }
    return scenario.replace("imu", scenario.imu.model_copy(update=changes))


def _with_jumps(scenario: Scenario, log: LogSamples) -> Scenario:
    """Let fixes jump when and as far as the log's do; each jump lasts to the end, as what has moved stays moved."""
    faults = tuple(
        GnssWrongFix(kind="gnss-wrong-fix", start_s=float(at), east_m=float(east), north_m=float(north))
        for at, east, north in s.jumps_of(log)
    )
    return scenario.model_copy(update={"faults": scenario.faults + faults})


class _Parts(NamedTuple):
    """Parts found by emulation: white noise of fixes, slip, roughness relative to class C, vibration at 1 m/s."""

    white_m: float
    slip: float
    roughness: float
    vibration: float


def _first_parts(log: LogSamples, found: Statistics, scenario: Scenario) -> _Parts:
    speed = _speed_mps(log)
    slip, rolling, shaking = (found[key].value or 0.0 for key in (s.SLIP, s.ROLLING, s.SHAKING))
    return _Parts(scenario.gnss.white_m, 2.0 * slip, rolling / (_RADPS_OF_C * speed), shaking / speed)


def _with_parts(scenario: Scenario, found: Statistics, parts: _Parts) -> Scenario:
    if _scatters(found):
        scenario = scenario.replace("gnss.white_m", parts.white_m)
    if found[s.SLIP].value is not None:
        scenario = scenario.replace("drive.slip_relative", parts.slip)
    if parts.roughness > 0.0:
        ground = Ground(**{**dict(scenario.ground), "roughness": "C", "roughness_factor": parts.roughness})
        scenario = scenario.replace("ground", ground)
    return _with_truth(scenario, vibration_mps2=parts.vibration) if parts.vibration > 0.0 else scenario


def _closer(scenario: Scenario, log: LogSamples, found: Statistics, imu_hz: float) -> Scenario:
    """Return the scenario with its parts scaled by what the emulation shows.

    Each part is emulated with the others, and once more all without any, which shows what else is in the statistics.
    """
    now = _Parts(
        scenario.gnss.white_m,
        scenario.drive.slip_relative,
        scenario.ground.roughness_factor,
        scenario.truth.vibration_mps2,
    )
    smooth = scenario.replace("drive.slip_relative", 0.0)
    if _scatters(found):
        smooth = smooth.replace("gnss.white_m", 0.0)
    smooth = _with_truth(smooth, vibration_mps2=0.0)
    without, within = (s.log_statistics(emulated(log, each, imu_hz)) for each in (smooth, scenario))
    white_m = now.white_m * _scale(found[s.SCATTER], within[s.SCATTER], without[s.SCATTER])
    slip = now.slip * _scale(found[s.SLIP], within[s.SLIP], without[s.SLIP])
    roughness = now.roughness * _scale(found[s.ROLLING], within[s.ROLLING], Told(0.0))
    ground = without[s.SHAKING].value
    rougher = Told(ground and ground * roughness / now.roughness)
    vibration = now.vibration * _scale(found[s.SHAKING], within[s.SHAKING], without[s.SHAKING], rougher)
    roughness = roughness if found[s.ROLLING].value else 0.0
    return _with_parts(scenario, found, _Parts(white_m, slip, roughness, vibration))


def _scatters(found: Statistics) -> bool:
    """Return True if the receiver is known by its scatter while moving alone."""
    return found[s.SCATTER].value is not None and found[s.DIFFERENCE[1.0]].value is None


def _scale(log: Told, within: Told, without: Told, beside: Told | None = None) -> float:
    """Return the factor on a part by which the emulation has the log's statistic.

    Args:
        log: Statistic of the log.
        within: Statistic of the emulation.
        without: Statistic of the emulation without the part.
        beside: Statistic without the part as it will be.
    """
    beside = beside or without
    if log.value is None or within.value is None or without.value is None or beside.value is None:
        return 1.0
    added, asked = within.value**2 - without.value**2, log.value**2 - beside.value**2
    return math.sqrt(max(asked, 0.0) / added) if added > 0.0 else 1.0


def _speed_mps(log: LogSamples) -> float:
    """Return the root mean square of the speed while the robot drives; 1 m/s if it does not."""
    speed = np.abs(log.speed_mps)
    moving = speed[speed > _LEAST_MPS]
    return float(np.sqrt(np.mean(moving**2))) if len(moving) else 1.0


def _with_truth(scenario: Scenario, **figures: float) -> Scenario:
    return scenario.replace("truth", Truth(**{**dict(scenario.truth), **figures}))


def _told(onboard: OnboardConfig, scenario: Scenario, found: Statistics) -> OnboardConfig:
    """Return the configuration with the noise of a scenario, where the log tells it."""
    noise, changes = scenario.gnss, dict[str, dict[str, float]]()
    if found[s.SIGMA].value is not None or found[s.SCATTER].value is not None:
        changes["gnss"] = {name: getattr(noise, name) for name in _OF_RECEIVER}
    if scenario.truth.wander_rad > 0.0:
        walk = scenario.truth.wander_rad * math.sqrt(2.0 * scenario.truth.wander_m)
        changes["drive"] = {"side_slip_m_rtm": walk}
    if found[s.SLIP].value is not None:
        changes["drive"] = {**changes.get("drive", {}), "slip_relative": scenario.drive.slip_relative}
    if found[s.GYRO_NOISE].value is not None:
        changes["imu"] = {name: getattr(scenario.imu, name) for name in _OF_GYRO}
    groups = {name: getattr(onboard, name).model_copy(update=values) for name, values in changes.items()}
    return onboard.model_copy(update=groups)
