"""Emulated 2D lidar: casts its beams among the things of the world."""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable
from functools import cached_property

import numpy as np

from touchline.services.robot_sim.sensors.auxiliary_truth import WorldSensor
from touchline.services.robot_sim.sensors.lidar_scan import LidarFigures, ScanArrays, measure_scan
from touchline.services.robot_sim.world.body import BodyState
from touchline.services.robot_sim.world.effects import Effects

_SYSTEMATIC = 0xFFFF  # channel of the error that a session shares


class LidarInWorld(WorldSensor):
    """Measures the range of every beam [m]; inf where nothing returns."""

    def measure(self, tick: int, _body: BodyState, effects: Effects) -> array[float]:
        """Return the ranges of the scan that ends with a tick; see `WorldSensor.measure`."""
        arrays = self._arrays
        blind, more_false_returns = bool(effects.lidar_blind), float(effects.lidar_false_share)
        self._scan(self._figures, arrays, self.surroundings.things, tick, blind, more_false_returns)
        return array("d", arrays.measured.tobytes())

    @cached_property
    def _figures(self) -> LidarFigures:
        spec, truth, draw = self.spec, self.truth, self.draw
        shared = 0.0 if draw.silent else 2.0 * draw.uniform(0, _SYSTEMATIC) - 1.0
        return LidarFigures(
            x_m=spec.x_m,
            y_m=spec.y_m,
            first_rad=spec.first_rad,
            step_rad=spec.step_rad,
            scan_s=spec.scan_s,
            height_m=spec.height_m,
            descent=math.tan(spec.pitch_rad + truth.pitch_error_rad),
            min_m=spec.min_m,
            max_m=spec.max_m,
            dark_m=min(spec.dark_m, spec.max_m),
            sigma_m=spec.sigma_m,
            sigma_relative=spec.sigma_relative,
            ground_sigma=truth.ground_sigma_relative,
            bias_m=shared * spec.systematic_m,
            mixed=min(0.5 * spec.beam_rad / spec.step_rad, 0.5),
            dropout=truth.dropout_share,
            false_returns=0.0 if draw.silent else truth.false_share,
            false_within_m=truth.false_within_m,
            sun_rad=math.nan if truth.sun_rad is None else truth.sun_rad,
            sun_half_rad=truth.sun_half_rad,
            sun_dropout=truth.sun_dropout_share,
            seed=draw.seed,
            sensor=draw.sensor,
            silent=draw.silent,
        )

    @cached_property
    def _arrays(self) -> ScanArrays:
        spec, figures = self.spec, self._figures
        numbers = np.arange(spec.beams)
        angles = spec.first_rad + spec.step_rad * numbers
        age_s = spec.scan_s * (1.0 - numbers / (spec.beams - 1))
        drop = figures.descent * np.cos(angles)
        none = np.zeros(spec.beams)
        directions = np.column_stack((np.cos(angles), np.sin(angles)))
        rays = np.zeros((spec.beams, 4))
        return ScanArrays(directions, rays, drop, age_s, none.copy(), none.copy(), none.copy())

    @cached_property
    def _scan(self) -> Callable[..., None]:
        """The kernel `measure_scan`, without checking the types of its arguments, which are always the same."""
        arguments = self._figures, self._arrays, self.surroundings.things, 0, False, 0.0
        code: Callable[..., None] = measure_scan.for_types_of(arguments)
        return code
