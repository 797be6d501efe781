"""All that may happen to a robot that is ready; prints the kernels that were not there by then or cannot be kept.

Run as `python -m tests.robot_sim.whole_life VEHICLE FOLLOWER JOB …` in a new process, for any number of robots: each
lives in a process forked from that one, which has imported what all of them need. JOB is a file of a LoadRequest.
"""

import json
import multiprocessing
import sys
import tempfile
import time
from pathlib import Path

from tests.late_kernels import LateKernels, tell_of_numba
from tests.meeting import caught_up
from tests.robot_sim.bus_rig import AtOnce, ask
from tests.robot_sim.scripted import trajectory
from touchline.bus import Bus, BusConfig, HealthReporter
from touchline.bus.ports import free_port
from touchline.onboard.perception.perception import lidars_of
from touchline.schemas import topics
from touchline.schemas.catalogue import load_vehicle
from touchline.schemas.cdr import decode
from touchline.schemas.curves import Curve
from touchline.schemas.messages import LoadRequest
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.plugins import FAULTS
from touchline.schemas.scenario import Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.vehicles.shipped import SHIPPED
from touchline.services.robot_sim.journal import Journal
from touchline.services.robot_sim.robot_process import RobotProcess
from touchline.services.robot_sim.warm_up import warm_up

MOST_S = 20.0
FAULTY_DRIVES = 6
NEEDED = {
    "disc-stuck": {"position": "up"},
    "messages-duplicated": {"sensor": "gnss"},
    "messages-late": {"sensor": "gnss", "delay_s": 0.3},
    "messages-lost": {"sensor": "encoder", "share": 0.5},
    "messages-reordered": {"sensor": "imu"},
    "valve-stuck": {"position": "open"},
}
"""Fields without which there is no such fault."""


class Life:
    """A robot's process, and what an operator asks of it."""

    def __init__(self, bus, operator, setup, journal, late):
        self._bus, self._operator, self._setup, self._journal, self._late = bus, operator, setup, journal, late
        self._kept = Journal(journal)
        self.begin()

    def begin(self):
        """Start the process anew."""
        self._late.doing = "start"
        self.end()
        health, outlet, self._kept = HealthReporter(self._bus), AtOnce(self._bus), Journal(self._journal)
        self._robot = RobotProcess(self._bus, health, self._setup, outlet, speed=-1.0, clock="held", journal=self._kept)
        caught_up(self._bus, self._operator)

    def end(self):
        """Leave the journal as a kill does."""
        self._kept.__exit__(None, None, None)

    def order(self, service, **fields):
        self._late.doing = f"{service.name} {fields.get('fault_json', '')}"
        return ask(self._operator, self._robot, service, **fields)

    def drive(self, job, seconds, **how):
        """Load a job, start it, and let time pass."""
        loaded = self.order(topics.LOAD, **{**dict(job), **how})
        assert loaded.success, loaded.message
        assert self.order(topics.START).success
        self.run(seconds)

    def run(self, seconds):
        """Let sim time pass, as long as it does."""
        emulator, deadline = self._robot._emulator, time.monotonic() + MOST_S
        last_s = emulator.time_s + seconds
        while emulator.time_s < last_s and emulator.active and time.monotonic() < deadline:
            self._robot.turn()

    @property
    def blocked(self):
        return self._robot._emulator.onboard.blocked

    @property
    def pose(self):
        return self._robot._emulator.onboard.estimate[:3]


def straight(pose, length_m):
    """A job of driving straight ahead."""
    x_m, y_m, heading_rad = pose
    return {"trajectory": trajectory([Curve(x_m, y_m, heading_rad, 0.0, length_m)], [0], speed_mps=0.25)}


def work(life, job):
    """A job with a pause, and all that a robot at rest can be asked."""
    life.drive(job, 6.0)
    life.order(topics.PAUSE)
    life.run(3.0)
    life.order(topics.REFILL_TANK)
    life.order(topics.REPLACE_BATTERY)
    life.order(topics.RESUME)
    life.run(3.0)
    life.order(topics.AUTHORIZE, until_m=1e9)
    life.order(topics.SET_SPEED, factor=50.0)
    life.run(3.0)
    life.order(topics.SET_SPEED, factor=-1.0)
    life.run(8.0)
    life.order(topics.ABORT)
    life.run(2.0)


def go_on_after_a_kill(life, job):
    life.begin()
    life.drive(job, 6.0)
    life.begin()
    life.drive(job, 3.0, resume=True)
    life.order(topics.ABORT)
    life.run(3.0)


def goal_and_another_under_way(life):
    life.begin()
    life.drive(straight((0.0, 0.0, 0.0), 2.0), 4.0)
    life.order(topics.LOAD, **straight((0.0, 0.0, 0.0), 2.5), replace=True)
    life.run(60.0)
    life.drive(straight(life.pose, 3.0), 1.0, here=True)


def stops(life, job):
    life.begin()
    life.drive(job, 4.0)
    life.order(topics.ESTOP)
    life.run(3.0)
    life.order(topics.RESET)
    life.run(1.0)


def team(life, coordinator):
    life.begin()
    life.order(topics.BEGIN_GUIDED, coordinator=coordinator.session_id, lockstep_s=0.0)
    life.run(2.0)
    life.order(topics.ABORT)
    life.run(2.0)


def faults(life, job):
    """All of them, several in each drive: those of one sensor in drives of their own, and a stop at the end."""
    names = sorted(FAULTS.names(), key=lambda name: (name == "bumper", name))
    for number in range(FAULTY_DRIVES):
        life.begin()
        life.order(topics.RESET)
        life.drive(job, 3.0)
        for name in names[number::FAULTY_DRIVES]:
            fault = {"kind": name, "duration_s": 0.5, **NEEDED.get(name, {})}
            life.order(topics.INJECT_FAULT, fault_json=json.dumps(fault))
            life.run(0.5)
        life.run(1.5)
        life.order(topics.RESUME)
        life.run(1.0)
        life.order(topics.RESET)


def something_in_the_way(life, job):
    """A post before the robot, which it sees, stops for, and waits for."""
    life.begin()
    life.drive(job, 15.0)
    assert life.blocked
    life.order(topics.ABORT)
    life.run(2.0)


def live(vehicle, follower, job):
    setup = Setup(vehicle=load_vehicle(vehicle), onboard=OnboardConfig(follower=follower))
    config = BusConfig(endpoint=f"tcp/127.0.0.1:{free_port()}")
    job = decode(LoadRequest, Path(job).read_bytes())
    tell_of_numba()
    warm_up(setup=setup, in_team=True)
    late = LateKernels()
    with (
        tempfile.TemporaryDirectory() as folder,
        Bus.open(topics.ROBOT_SIM, config) as bus,
        Bus.open(topics.OPERATOR, config) as operator,
        Bus.open(topics.COORDINATOR, config) as coordinator,
    ):
        life = Life(bus, operator, setup, Path(folder) / "journal", late)
        work(life, job)
        go_on_after_a_kill(life, job)
        goal_and_another_under_way(life)
        stops(life, job)
        team(life, coordinator)
        if vehicle not in SHIPPED or follower == SHIPPED[vehicle].follower:
            faults(life, job)
        life.end()
        if lidars_of(setup.vehicle):
            post = Scenario(objects=[{"kind": "post", "x_m": 3.0, "y_m": 0.0}])
            life = Life(bus, operator, setup.model_copy(update={"scenario": post}), Path(folder) / "other", late)
            something_in_the_way(life, job)
            life.end()
    late.found = [f"{vehicle}, {follower}: {kernel}" for kernel in late.found]
    late.tell()


def main(*robots):
    for robot in zip(robots[::3], robots[1::3], robots[2::3], strict=True):
        process = multiprocessing.get_context("fork").Process(target=live, args=robot)
        process.start()
        process.join()
        if process.exitcode:
            sys.exit(f"{robot}: exit code {process.exitcode}")


if __name__ == "__main__":
    main(*sys.argv[1:])
