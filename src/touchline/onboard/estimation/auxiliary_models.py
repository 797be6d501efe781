"""Auxiliary sensors in the estimator: base class of their measurement models, with Jacobian and noise."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.onboard.estimation.filter import Estimator
from touchline.onboard.filter_model import RING, STATES, UPDATE_COLUMNS, UPDATE_VALUE, UPDATE_VARIANCE
from touchline.onboard.interface import TICKS_PER_S, AuxiliarySample
from touchline.schemas.plain_text import plain
from touchline.schemas.plugins import SENSORS, log_plugin_error, part_for
from touchline.schemas.vehicles import SensorSpec, Vehicle

Floats = NDArray[np.float64]

_LONGEST = 200


class ScalarUpdate(NamedTuple):
    """Comparison of one measured number with the state: z = h(x) + v.

    Attributes:
        innovation: z − h(x).
        jacobian: (STATES,) Jacobian of h at x; states are those of `filter_model`.
        variance: Variance of v.
    """

    innovation: float
    jacobian: Floats
    variance: float


class OnboardSensor:
    """Base class of the measurement models of auxiliary sensors; one object is made for each sensor of the vehicle.

    Args:
        spec: Data sheet.
        vehicle: Vehicle that carries the sensor.
    """

    def __init__(self, spec: SensorSpec, vehicle: Vehicle) -> None:
        self.spec, self.vehicle = spec, vehicle

    def updates(self, values: tuple[float, ...], state: Floats) -> Sequence[ScalarUpdate]:
        """Return the updates of the state by a measurement; none if it says nothing about the state.

        Args:
            values: Measured values, as the emulated sensor of this kind gives them.
            state: (STATES,) state in the tick in which they were measured.
        """
        raise NotImplementedError


class AuxiliarySensors:
    """Measurement models of a vehicle's auxiliary sensors; a model that fails is not asked again.

    Attributes:
        used: Number of measured numbers that were used, by the sensor's name.
        rejected: Number of those that lay outside their gate, came too late, or were too many, by the sensor's name.
    """

    def __init__(self, vehicle: Vehicle, estimator: Estimator) -> None:
        """Make the models of those sensors of a vehicle that its computer uses."""
        self._estimator = estimator
        self._models: dict[str, OnboardSensor] = {}
        for spec in vehicle.sensors:
            parts = SENSORS.find(spec.kind)
            if parts is not None and parts.onboard is not None:
                self._models[spec.name] = part_for(SENSORS, spec.kind, "onboard")(spec, vehicle)
        if self._models:
            estimator.prepare_rows()
        self.used = dict.fromkeys(self._models, 0)
        self.rejected = dict.fromkeys(self._models, 0)

    def take(self, samples: Sequence[AuxiliarySample]) -> list[str]:
        """Use measurements that have arrived, in the order of their arrival.

        Args:
            samples: Measurements.

        Returns:
            Errors of models that failed.
        """
        flaws = []
        for sample in samples:
            model = self._models.get(sample.sensor)
            if model is None or not self._estimator.started:
                continue
            try:
                self._use(model, sample)
            except Exception as error:  # noqa: BLE001, whatever somebody else's code does
                del self._models[sample.sensor]
                whose = f"{SENSORS.described(model.spec.kind)}, {sample.sensor},"
                flaws.append(plain(f"{whose} fails with {type(error).__name__}: {error}", _LONGEST))
                log_plugin_error(flaws[-1])
        return flaws

    def _use(self, model: OnboardSensor, sample: AuxiliarySample) -> None:
        times, at = self._estimator.times, math.floor(sample.stamp_s * TICKS_PER_S + 1e-6)
        if at < times.first_tick or not 0 <= times.tick - at <= RING - 2:
            self.rejected[sample.sensor] += 1
            return
        state = self._estimator.ring.states[at % RING]
        rows = [_row(update, state) for update in model.updates(tuple(sample.values), state.copy())]
        for row in rows:
            taken = self._estimator.take_row(at, row)
            (self.used if taken else self.rejected)[sample.sensor] += 1


def _row(update: ScalarUpdate, state: Floats) -> Floats:
    """Return the row of the ring for an update, (UPDATE_COLUMNS,), linearised at this state.

    Raises:
        ValueError: Its numbers are not finite, or its variance is not positive.
    """
    row: Floats = np.empty(UPDATE_COLUMNS)
    row[:STATES] = update.jacobian
    row[UPDATE_VALUE] = update.innovation + row[:STATES] @ state
    row[UPDATE_VARIANCE] = update.variance
    if not np.isfinite(row).all() or update.variance <= 0.0:
        raise ValueError(f"an update is not usable: innovation {update.innovation}, variance {update.variance}")
    return row
