"""The true robot: state, constants and the step from one onboard tick to the next."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from schemas.scenario import Scenario
from schemas.vehicle import Vehicle
from services.robot_sim.frames import TICK_S, Command
from services.robot_sim.world import body
from services.robot_sim.world.effects import neutral
from services.robot_sim.world.randomness import STREAM_CHASSIS, normal

NO_EFFECTS: Final = neutral()


class Pose(NamedTuple):
    """Axle centre and heading in the map frame; the heading is not wrapped."""

    east_m: float
    north_m: float
    heading_rad: float


class World:
    """What is true about the robot and its consumables.

    Args:
        vehicle: The nominal robot.
        scenario: Seed, errors of the chassis and slip; `effective()` is taken here.

    Attributes:
        state: (body.STATE_SIZE,) the truth, indexed by the constants of `body`.
        trace: (body.STEPS + 1, 3) the nozzle during the last tick.
    """

    def __init__(self, vehicle: Vehicle, scenario: Scenario) -> None:
        """See the class."""
        self.state: NDArray[np.float64] = np.zeros(body.STATE_SIZE)
        self.trace: NDArray[np.float64] = np.zeros(body.TRACE_SHAPE)
        self._seed = scenario.seed
        self._parameters = _parameters(vehicle, scenario.effective())
        self.state[body.TANK_L] = vehicle.tank_l
        self.state[body.BATTERY_WH] = vehicle.battery_wh

    @property
    def pose(self) -> Pose:
        """Where the robot truly is."""
        return Pose(*self.state[body.EAST : body.HEADING + 1].tolist())

    def place(self, pose: Pose) -> None:
        """Put the robot at rest at `pose`, as if carried there; tank, battery and wheel angles stay."""
        self.state[body.EAST], self.state[body.NORTH], self.state[body.HEADING] = pose
        for quantity in (body.LEFT_RATE, body.RIGHT_RATE, body.SPEED, body.YAW_RATE):
            self.state[quantity] = 0.0

    def step(self, command: Command, tick: int, effects: NDArray[np.float64] = NO_EFFECTS) -> None:
        """Advance by one onboard tick under `command` and the `effects` of faults; `tick` keys the randomness."""
        left, right, valve, disc = command
        body.advance(self.state, self._parameters, left, right, valve, disc, self._seed, tick, self.trace)


def _parameters(vehicle: Vehicle, scenario: Scenario) -> NDArray[np.float64]:
    drive, seed = scenario.drive, scenario.seed
    p = np.zeros(body.PARAMETER_SIZE)
    for wheel in (body.P_LEFT_RADIUS, body.P_RIGHT_RADIUS):
        error = drive.wheel_radius_relative * normal(seed, STREAM_CHASSIS, 0, wheel)
        p[wheel] = vehicle.wheel_radius_m * (1.0 + error)
    error = drive.track_width_relative * normal(seed, STREAM_CHASSIS, 0, body.P_TRACK)
    p[body.P_TRACK] = vehicle.track_width_m * (1.0 + error)
    p[body.P_MAX_RATE] = vehicle.max_wheel_speed_radps
    p[body.P_MAX_ACCEL] = vehicle.max_wheel_acceleration_radps2
    p[body.P_LAG] = vehicle.motor_time_constant_s
    p[body.P_SLIP_SIGMA] = drive.slip_relative
    p[body.P_SLIP_DECAY] = math.exp(-TICK_S / drive.slip_tau_s)
    p[body.P_NOZZLE_X], p[body.P_NOZZLE_Y] = vehicle.nozzle_x_m, vehicle.nozzle_y_m
    p[body.P_VALVE_ON] = _travel(vehicle.valve_on_delay_s)
    p[body.P_VALVE_OFF] = _travel(vehicle.valve_off_delay_s)
    p[body.P_DISC] = _travel(vehicle.disc_delay_s)
    p[body.P_FLOW_LPS] = vehicle.paint_l_per_m * vehicle.paint_speed_mps
    p[body.P_IDLE_W] = vehicle.idle_power_w
    p[body.P_DRIVE_W] = vehicle.drive_power_w_per_mps
    return p


def _travel(delay_s: float) -> float:
    """Plunger travel in one physics step; a whole stroke when there is no delay."""
    return min(1.0, body.STEP_S / delay_s) if delay_s > 0.0 else 1.0
