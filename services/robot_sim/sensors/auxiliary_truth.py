"""Emulated auxiliary sensors: base class for their kinds, and the sensors of a vehicle."""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple
from zlib import crc32

import numpy as np

from touchline.core.random import STREAM_AUXILIARY, normal, uniform
from touchline.onboard.interface import TICKS_PER_S, AuxiliarySample
from touchline.schemas.errors import SpecError
from touchline.schemas.plugins import SENSORS, part_for
from touchline.schemas.scenario import Scenario
from touchline.schemas.sensor_truth import SensorTruth
from touchline.schemas.vehicles import SensorSpec, Vehicle
from touchline.services.robot_sim.sensors.moment import Moment
from touchline.services.robot_sim.sensors.transport import latency_ticks
from touchline.services.robot_sim.world.body import BodyState
from touchline.services.robot_sim.world.effects import MOST_SENSORS, Effects
from touchline.services.robot_sim.world.objects.surroundings import Surroundings

_NEVER = 1 << 60


class Draw(NamedTuple):
    """Random numbers of one sensor: each is a pure function of seed, sensor, tick and channel.

    Attributes:
        seed: Seed of the scenario.
        sensor: Number made of the sensor's name.
        silent: True in a scenario without noise.
    """

    seed: int
    sensor: int
    silent: bool

    def normal(self, tick: int, channel: int = 0) -> float:
        """Draw from the standard normal distribution; 0 without noise."""
        return 0.0 if self.silent else float(normal(self.seed, STREAM_AUXILIARY, tick, self.sensor + channel))

    def uniform(self, tick: int, channel: int = 0) -> float:
        """Draw from the uniform distribution on [0, 1); 1 without noise, which no share exceeds."""
        return 1.0 if self.silent else float(uniform(self.seed, STREAM_AUXILIARY, tick, self.sensor + channel))


class WorldSensor:
    """Base class of emulated auxiliary sensors; one object is made for each sensor of the vehicle.

    It keeps no state from one measurement to the next: a measurement follows from the arguments and the random numbers,
    so that a session can be continued or repeated from any tick.

    Args:
        spec: Data sheet.
        truth: Errors, and objects to measure.
        draw: Random numbers.

    Attributes:
        surroundings: Things around the robot, and its true poses of the last second; set when the sensor is mounted.
    """

    surroundings: Surroundings

    def __init__(self, spec: SensorSpec, truth: SensorTruth, draw: Draw) -> None:
        self.spec, self.truth, self.draw = spec, truth, draw

    def measure(self, tick: int, body: BodyState, effects: Effects) -> Sequence[float] | None:
        """Return the values measured at the end of a tick, a new object; None for no measurement.

        Args:
            tick: Tick that ends.
            body: True state of the body.
            effects: Effects of faults.
        """
        raise NotImplementedError


class UnderWay(NamedTuple):
    """A measurement on its way to the robot's computer."""

    arrival_tick: int
    sample: AuxiliarySample

    def as_json(self) -> list[Any]:
        """Return its values for JSON; `from_json` reads them."""
        return [self.arrival_tick, self.sample.sensor, self.sample.stamp_s, list(self.sample.values)]

    @classmethod
    def from_json(cls, values: list[Any]) -> UnderWay:
        """Return the measurement with the values of `as_json`.

        Raises:
            ValueError, TypeError: The values are not those of a measurement.
        """
        tick, sensor, stamp_s, numbers = values
        return cls(int(tick), AuxiliarySample(str(sensor), float(stamp_s), tuple(map(float, numbers))))


class _Mounted(NamedTuple):
    sensor: WorldSensor
    period_ticks: int
    latency_ticks: int
    number: int
    """Number of its kind in `SENSORS`."""


class AuxiliaryTruth:
    """Emulated auxiliary sensors of a vehicle, and their measurements under way.

    Attributes:
        next_tick: Next tick at whose end a sensor measures or a measurement arrives.
        specs: Data sheet of each sensor, by its name.
    """

    def __init__(self, vehicle: Vehicle, scenario: Scenario, surroundings: Surroundings) -> None:
        """Mount the sensors of a vehicle in the world of a scenario."""
        truths = {truth.kind: truth for truth in scenario.sensors}
        self._mounted = tuple(_mounted(spec, truths.get(spec.kind), scenario, surroundings) for spec in vehicle.sensors)
        self.specs = {spec.name: spec for spec in vehicle.sensors}
        self._seed = scenario.seed
        self._delays: Callable[..., tuple[int, int]] | None = None
        if self._mounted:  # compiled now: later, the robot would have to wait for it
            count = len(vehicle.drive.actuators)
            body, effects = BodyState.sized(count)(), Effects.sized(count)()
            self._delays = latency_ticks.for_types_of((Moment(body.array, effects.array, self._seed, 0), 0))
        self._under_way: list[UnderWay] = []
        self.next_tick = _NEVER
        self._plan(0)

    def _plan(self, tick: int) -> None:
        """Set `next_tick` to the next tick after this one in which there is something to do."""
        due = [(tick // each.period_ticks + 1) * each.period_ticks for each in self._mounted]
        self.next_tick = min([*due, *(each.arrival_tick for each in self._under_way)], default=_NEVER)

    def step(self, tick: int, body: BodyState, effects: Effects) -> tuple[AuxiliarySample, ...]:
        """Measure at the end of a tick, and return the measurements that arrive in it, in the order of measurement.

        Args:
            tick: Tick that ends; it must not lie before the last one.
            body: True state of the body.
            effects: Effects of faults.
        """
        if tick < self.next_tick:
            return ()
        for each in self._mounted:
            if tick % each.period_ticks == 0 and (values := each.sensor.measure(tick, body, effects)) is not None:
                self._send(each, values, Moment(body.array, effects.array, self._seed, tick))
        arrived = tuple(each.sample for each in self._under_way if each.arrival_tick <= tick)
        self._under_way = [each for each in self._under_way if each.arrival_tick > tick]
        self._plan(tick)
        return arrived

    def _send(self, mounted: _Mounted, values: Sequence[float], moment: Moment) -> None:
        """Put a measurement under way; faults may delay, repeat or lose it."""
        assert self._delays is not None
        if not (isinstance(values, array) and values.typecode == "d"):
            values = tuple(np.asarray(values, np.float64).tolist())
        sample = AuxiliarySample(mounted.sensor.spec.name, moment.tick / TICKS_PER_S, values)
        for delay in self._delays(moment, mounted.number):
            if delay >= 0:
                self._under_way.append(UnderWay(moment.tick + mounted.latency_ticks + delay, sample))

    @property
    def under_way(self) -> tuple[UnderWay, ...]:
        """Measurements that have not arrived."""
        return tuple(self._under_way)

    def restore(self, under_way: Iterable[UnderWay], tick: int) -> None:
        """Replace the measurements under way.

        Args:
            under_way: Measurements; those of sensors that the vehicle does not have are left out.
            tick: Tick that has ended; measurements that arrived by then are left out.
        """
        self._under_way = [each for each in under_way if each.arrival_tick > tick and each.sample.sensor in self.specs]
        self._plan(tick)


def _mounted(spec: SensorSpec, truth: SensorTruth | None, scenario: Scenario, surroundings: Surroundings) -> _Mounted:
    made = part_for(SENSORS, spec.kind, "world")
    if truth is None:
        told = SENSORS.find(spec.kind)
        truth = part_for(SENSORS, spec.kind, "truth")() if told and told.truth else SensorTruth(kind=spec.kind)
    draw = Draw(scenario.seed, crc32(spec.name.encode()) << 16, scenario.noise == "none")
    number, delay_ticks = SENSORS.number(spec.kind), math.ceil(spec.latency_s * TICKS_PER_S - 1e-7)
    if number >= MOST_SENSORS:
        remedy = f"uninstall packages that bring sensors: {MOST_SENSORS} kinds are the most"
        raise SpecError("vehicle", "sensors.kind", f"is {spec.kind!r}, of too many kinds that are registered", remedy)
    sensor = made(spec, truth, draw)
    sensor.surroundings = surroundings
    return _Mounted(sensor, TICKS_PER_S // spec.rate_hz, delay_ticks, number)
