"""A robot that is given one job after another, while its services stay up, and all that it tells."""

import json
from dataclasses import dataclass, field

from tests.checking.short_sessions import BEND
from touchline.recordings.recorder import Recorder
from touchline.schemas import topics
from touchline.schemas.faults import parse_fault
from touchline.schemas.messages import PlanOptions, PoseGoal
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.plan_cause import PlanCause
from touchline.schemas.scenario import Scenario
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.goal_plan import plan_to_goal
from touchline.services.planner.plan import plan
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.loaded_job import Taking
from touchline.services.robot_sim.recovery_state import EarlierWork
from touchline.services.robot_sim.telemetry import Telemetry

ROBOT = "tt2"
LONGEST_TICKS = 6000


def write(path, told):
    """The messages, as a recording."""
    recorder, counts = Recorder(path, (ROBOT,), topics.RECORDED), {}
    for topic, payload in told:
        if topic.recorded:
            counts[topic.name] = counts.get(topic.name, 0) + 1
            recorder.write(topic.name, payload, counts[topic.name])
    recorder.finish()
    return path


@dataclass
class Day:
    """The robot, and what it has told so far."""

    vehicle: Vehicle = field(default_factory=Vehicle)
    scenario: Scenario = field(default_factory=lambda: Scenario(seed=5))
    config: OnboardConfig = field(default_factory=OnboardConfig)
    told: list = field(default_factory=list)
    template: Template = BEND

    def __post_init__(self):
        self.switch_on()
        self.options = PlanOptions()
        self.plan = plan(self.template, self.vehicle, self.options).trajectory

    def switch_on(self):
        """Another process begins."""
        self.emulator = Emulator(self.vehicle, self.scenario, self.config)
        self.telemetry = Telemetry(self.emulator)
        self.runner = FastRunner(self.emulator)
        self.setup = [self.telemetry.setup(), *self.telemetry.standing()]
        self.told += self.setup

    def take(self, trajectory, template, cause, *resumed, taking=Taking.CARRIED):
        job = self.emulator.prepare(trajectory, template, *(resumed or (None, None)), taking)
        self.emulator.take(job._replace(cause=cause))
        self.told += self.telemetry.loaded(trajectory, template)
        if resumed:
            self.told += self.telemetry.restored_paint()

    def load(self, *resumed):
        self.take(self.plan, self.template, PlanCause(options=self.options), *resumed)

    def load_drive(self, ahead_m):
        """A drive from where the robot stands."""
        x_m, y_m, heading_rad, *_ = self.emulator.onboard.estimate
        options = PlanOptions(start=(x_m, y_m, heading_rad))
        goal = PoseGoal(x_m=x_m + ahead_m, y_m=y_m + 0.4, heading_rad=float("nan"))
        trajectory = plan_to_goal(goal, self.vehicle, options).trajectory
        self.take(trajectory, None, PlanCause(options=options, goal=goal), taking=Taking.HERE)

    def order(self, name, *args):
        getattr(self.emulator, name)(*args)
        supplied = name in ("refill_tank", "replace_battery")
        self.told += self.telemetry.supplies() if supplied else self.telemetry.news()

    def fault(self, **values):
        self.order("inject_fault", parse_fault(json.dumps({"start_s": 0.0, **values})))

    def pass_ticks(self, ticks):
        for _ in range(ticks):
            self.emulator.tick()
            self.told += self.telemetry.after_tick()

    def drive(self, ticks=LONGEST_TICKS):
        """On for so long, or to the end."""
        last = self.emulator.tick_count + ticks
        while self.emulator.active and self.emulator.tick_count < last:
            most = self.telemetry.until_due(last - self.emulator.tick_count)
            self.told += self.telemetry.after(self.runner.step(most, self.telemetry.rows))
        assert ticks < LONGEST_TICKS or not self.emulator.active

    def job(self):
        self.load()
        self.order("start")
        self.drive()

    def brief_job(self):
        """One that ends as the robot has set off."""
        self.load()
        self.order("start")
        self.drive(110)
        self.order("abort")
        self.drive()

    def be_killed(self):
        """The process dies, and the next one goes on from its journal."""
        checkpoint = self.emulator.onboard.checkpoint
        remains = EarlierWork(self.emulator.totals, self.emulator.work.ledger.rows(0).copy())
        self.pass_ticks(5)
        self.switch_on()
        self.load(checkpoint, remains)

    def recorded(self, first, end=None):
        """As a recording has it that begins before the message of this number: with the setup, which is latched."""
        return [*self.setup, *self.told[first:end]]

    def later(self, number):
        """As a recording has it of this one of the later jobs alone."""
        return self.recorded(*[*self.begins, None][number : number + 2])

    @property
    def begins(self):
        """The numbers of the messages that tell in which state the robot was given a job."""
        return [number for number, (topic, _) in enumerate(self.told) if topic is topics.INITIAL_STATE]
