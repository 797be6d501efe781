"""Emulated bumper strip: the force of contacts on a stretch of the outline."""

from __future__ import annotations

from touchline.services.robot_sim.sensors.auxiliary_truth import WorldSensor
from touchline.services.robot_sim.world.body import BodyState
from touchline.services.robot_sim.world.effects import Effects


class BumperStripInWorld(WorldSensor):
    """Measures the mean force on a strip in the last tick [N]."""

    def measure(self, _tick: int, _body: BodyState, _effects: Effects) -> tuple[float, ...]:
        """Return the force; see `WorldSensor.measure`."""
        surroundings = self.surroundings
        return (float(surroundings.things.pressed_n[surroundings.strips.index(self.spec.name)]),)
