"""An open-loop robot under faults: what is true and what its computer is told, tick by tick."""

import json
import math
from typing import NamedTuple

import numpy as np

from touchline.onboard.interface import Command, SensorFrame
from touchline.schemas.faults import fault_models, parse_fault
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.fault_timeline import FaultTimeline
from touchline.services.robot_sim.sensors.moment import Moment
from touchline.services.robot_sim.sensors.sampling import stand_by
from touchline.services.robot_sim.sensors.suite import Sensors
from touchline.services.robot_sim.world import body
from touchline.services.robot_sim.world.world import World

VEHICLE = Vehicle()
FAULTS = tuple(fault_models().values())
AT_REST = World(VEHICLE, Scenario(noise="none"))
STILL = AT_REST.state
AHEAD = Command((10.0, 10.0), True, True)
REST = Command((0.0, 0.0), False, False)


class Tick(NamedTuple):
    """Samples and spray of a tick, and copies of the world's records at its end."""

    frame: SensorFrame
    states: np.ndarray
    drives: np.ndarray
    sprayed: bool
    width: float

    @property
    def state(self):
        return self.states.view(np.recarray)[0]

    @property
    def drive(self):
        return self.drives.view(np.recarray)[0]


def drive(ticks, *faults, command=AHEAD, seed=1, **scenario):
    """An open-loop run: the same commands, whatever the sensors say."""
    scenario = Scenario(seed=seed, faults=faults, **scenario)
    world, sensors = World(VEHICLE, scenario), Sensors(VEHICLE, scenario)
    timeline = FaultTimeline(scenario.faults, VEHICLE.drive)
    run = []
    for tick in range(1, ticks + 1):
        timeline.step(tick)
        world.step(command, tick, timeline.effects)
        frame = sensors.read(tick, world.state, timeline.effects)
        widths = world.trace[1:, body.TRACE_SPRAYING]
        run.append(
            Tick(frame, world.state.array.copy(), world.drive.array.copy(), bool(widths.any()), float(widths.max()))
        )
    return run


def lived(scenario, tick):
    """The frame of a tick of a robot that has stood until then."""
    sensors = Sensors(VEHICLE, scenario)
    stand_by(Moment(STILL.array, AT_REST.no_effects.array, scenario.seed, 1), tick - 1, sensors.sensing)
    return sensors.read(tick, STILL)


def fault(kind, **fields):
    return parse_fault(json.dumps({"kind": kind, **fields}))


def second(kind, **fields):
    """A fault that acts in the second second."""
    return fault(kind, start_s=1.0, duration_s=1.0, **fields)


def fixes(run):
    return [fix for tick in run for fix in tick.frame.gnss]


def errors(run):
    """(stamp, distance of the fix from the antenna's truth) of every fix."""
    return [
        (
            fix.stamp_s,
            math.hypot(
                fix.east_m - run[round(fix.stamp_s * 100) - 1].state.east_m,
                fix.north_m - run[round(fix.stamp_s * 100) - 1].state.north_m,
            ),
        )
        for fix in fixes(run)
    ]


def solutions(run):
    """(first stamp, solution) of every spell."""
    spells = []
    for fix in fixes(run):
        if not spells or spells[-1][1] != fix.fix:
            spells.append((round(fix.stamp_s, 3), fix.fix))
    return spells


def ages(run, sensor):
    return [getattr(tick.frame, f"{sensor}_age_ticks") for tick in run]
