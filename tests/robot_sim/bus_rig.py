"""A short job, and the robot doing it: on a bus, turn by turn, or in this process alone."""

import time
import uuid

from tests.meeting import caught_up
from tests.robot_sim.scripted import along_x
from touchline.bus import HealthReporter
from touchline.checking.divergence import stamp_ns
from touchline.schemas import topics
from touchline.schemas.cdr import decode, encode
from touchline.schemas.messages import Header, TraversalReport, TraversalStatus
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.template import Template
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.frame import CARRIED
from touchline.services.robot_sim.robot_process import RobotProcess
from touchline.services.robot_sim.telemetry import MOST_TICKS, Telemetry

PLAN = along_x(0, 0.8, 1.4, 1.9, sprayed=[0, 1, 0], ids=["t0", "line", "t1"], speed_mps=0.8)
TEMPLATE = Template(name="one", segments=[{"id": "line", "line": {"start": (0.8, -0.41124), "end": (1.4, -0.41124)}}])
LONG_PLAN = along_x(0, 5, sprayed=[0], speed_mps=0.5)
"""Of 12 s, for what has to happen in real time while the robot drives."""


AWAKE = (topics.SPRAYER, topics.BATTERY, topics.GNSS_STATUS, topics.ODOMETRY)
"""Messages of a standing robot when its process begins and before a job, which belong to no session."""


class AtOnce:
    """An outlet that publishes on the robot's own bus, so that no other process is needed."""

    behind, dropped, restarts = False, 0, 0

    def __init__(self, bus):
        self._publishers = {topic.name: bus.publisher(topic) for topic in CARRIED}

    def send(self, payloads):
        for topic, payload in payloads:
            self._publishers[topic.name].send_bytes(payload)

    def turn(self):
        return False


def setup(**changes):
    """Of a shipped robot; what is no field of the scenario is one of the robot's computer.

    Its follower is the one that takes least time. A machine that stands still for longer than Zenoh keeps a silent
    session parts robot and operator.
    """
    changes = {"link_timeout_s": 1000.0, "follower": "pure-pursuit"} | changes
    world = {name: changes.pop(name) for name in Scenario.model_fields if name in changes}
    return Setup(scenario=Scenario(**world), onboard=OnboardConfig(**changes))


def process(bus, speed=-1.0, journal=None, **changes):
    return RobotProcess(
        bus,
        HealthReporter(bus),
        setup(**changes),
        AtOnce(bus),
        speed=speed,
        clock="held",
        journal=journal,
    )


def ask(operator, robot, service, **fields):
    if "request_id" in service.request.model_fields:
        fields["request_id"] = str(uuid.uuid4())
    return operator.call(service, service.request(**fields), 100.0, while_waiting=robot.turn)  # it may compile first


def turn_until(robot, condition, timeout_s=100.0):
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline, "it never happened"
        robot.turn()


def drain(inbox, into):
    into += [(sample.topic, sample.payload) for sample in inbox.drain()]
    return into


def session(bus, robot, operator):
    """Load and run a whole session of the robot on `bus`; every recorded payload, per topic."""
    inbox = operator.inbox(topics.RECORDED)
    before = (topics.STATUS, encode(TraversalStatus(header=Header(frame_id="map"))))  # latched: may arrive or not
    caught_up(bus, operator)
    assert ask(operator, robot, topics.LOAD, trajectory=PLAN, template_json=TEMPLATE.model_dump_json()).success
    assert ask(operator, robot, topics.START).success
    said = []

    def reported():
        new = drain(inbox, [])
        said.extend(new)
        return any(topic is topics.REPORT for topic, _ in new)

    turn_until(robot, reported)
    caught_up(operator, bus)
    drain(inbox, said)
    said = [pair for pair in said if pair != before]
    said = [(topic, payload) for topic, payload in said if topic not in AWAKE or stamp_ns(payload) > 0]
    return {topic.name: [payload for name, payload in said if name is topic] for topic in topics.RECORDED}


def alone(**changes):
    """All that is said in-process, from the load on."""
    robot = setup(**changes)
    emulator = Emulator(robot.vehicle, robot.scenario, robot.onboard)
    telemetry = Telemetry(emulator)
    emulator.load(PLAN, TEMPLATE)
    said = telemetry.loaded(PLAN, TEMPLATE)
    emulator.start()
    said += telemetry.news()
    runner = FastRunner(emulator)
    while emulator.active:
        said += telemetry.after(runner.step(telemetry.until_due(MOST_TICKS), telemetry.rows))
    return said


def hash_in(said):
    (report,) = [decode(TraversalReport, payload) for topic, payload in said if topic is topics.REPORT]
    return report.session_hash
