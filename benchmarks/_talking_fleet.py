"""Robots that only talk, each as much and as often as one that paints: `python -m benchmarks._talking_fleet NAMES`.

What they say is encoded before, so that fifty of them take a part of a core.
"""

from __future__ import annotations

import math
import sys
import time
from dataclasses import dataclass

import numpy as np

from touchline.bus import Bus, BusConfig, Publisher, Server
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.catalogue import load_template
from touchline.schemas.cdr import encode
from touchline.schemas.setup import Setup

TURN_S = 0.02
"""Between two messages of odometry."""
RATES_HZ = {
    topics.ODOMETRY: 50,
    topics.STATUS: 10,
    topics.CLOCK: 10,
    topics.TRUE_COVERAGE: 10,
    topics.GNSS_STATUS: 10,
    topics.PAINT: 10,
    topics.DIAGNOSTICS: 5,
    topics.BATTERY: 1,
    topics.SPRAYER: 1,
}
SPEAKERS = (topics.ROBOT_SIM, topics.TELEMETRY, topics.PLANNER, topics.BRIDGE)
"""Nodes that publish diagnostics under the name of a robot."""
ROUND = 200
"""Number of positions on a robot's circle."""
ORDERS = (topics.ESTOP, topics.PAUSE, topics.RESUME, topics.ABORT, topics.RESET)


@dataclass
class Talker:
    """One robot's bus, its publishers and its services."""

    bus: Bus
    publishers: dict[topics.Topic, Publisher]
    servers: list[Server[m.CommandRequest, m.CommandResponse]]
    number: int
    stopped: bool = False

    def answer(self, statuses: dict[bool, bytes]) -> None:
        """Answer all pending orders."""
        for server in self.servers:
            while (call := server.poll()) is not None:
                self.stopped = server.service in (topics.ESTOP, topics.PAUSE) or self.stopped
                if server.service in (topics.RESUME, topics.RESET):
                    self.stopped = False
                call.reply(m.CommandResponse(success=True, message="done"))
                self.publishers[topics.STATUS].send_bytes(statuses[self.stopped])


def talk(config: BusConfig) -> None:
    """Talk until the process is ended."""
    with Bus.open_all(topics.ROBOT_SIM, config) as buses:
        outgoing = (*RATES_HZ, topics.SETUP)
        talkers = [
            Talker(
                bus, {topic: bus.publisher(topic) for topic in outgoing}, [bus.serve(each) for each in ORDERS], number
            )
            for number, bus in enumerate(buses)
        ]
        setup = encode(m.String(data=Setup().model_dump_json()))
        for talker in talkers:
            talker.publishers[topics.SETUP].send_bytes(setup)
        status = {stopped: encode(_status(stopped=stopped)) for stopped in (False, True)}
        payloads = {topic: [encode(message)] for topic, message in _messages().items()}
        payloads[topics.DIAGNOSTICS] = [encode(_diagnostics(name)) for name in SPEAKERS]
        rounds = [[encode(_odometry(talker.number, tick)) for tick in range(ROUND)] for talker in talkers]
        due_s, tick = time.monotonic(), 0
        while True:
            for talker in talkers:
                talker.answer(status)
                _publish(
                    talker,
                    tick,
                    payloads
                    | {
                        topics.STATUS: [status[talker.stopped]],
                        topics.ODOMETRY: rounds[talker.number][tick % ROUND :][:1],
                    },
                )
            tick += 1
            due_s += TURN_S
            if (left_s := due_s - time.monotonic()) > 0:
                time.sleep(left_s)


def _publish(talker: Talker, tick: int, payloads: dict[topics.Topic, list[bytes]]) -> None:
    """Publish the messages due in this turn; robots publish at different times."""
    for topic, rate_hz in RATES_HZ.items():
        if (tick + talker.number) % round(1.0 / TURN_S / rate_hz) == 0:
            for payload in payloads[topic]:
                talker.publishers[topic].send_bytes(payload)


def _odometry(number: int, tick: int) -> m.Odometry:
    """Pose on a separate circle for each robot, in rows of ten."""
    angle = 2 * math.pi * tick / ROUND + number
    turn = m.Quaternion(z=math.sin(angle / 2), w=math.cos(angle / 2))
    position = m.Point(x=12.0 * (number % 10) + 3 * math.sin(angle), y=9.0 * (number // 10) - 3 * math.cos(angle))
    covariance = np.diag([1e-4, 1e-4, 0, 0, 0, 1e-4]).ravel()
    pose = m.PoseWithCovariance(pose=m.Pose(position=position, orientation=turn), covariance=covariance)
    twist = m.TwistWithCovariance(twist=m.Twist(linear=m.Vector3(x=1.0)))
    return m.Odometry(header=m.Header(frame_id="map"), pose=pose, twist=twist)


def _status(*, stopped: bool) -> m.TraversalStatus:
    segments = load_template("soccer-11").segments
    return m.TraversalStatus(
        state=m.TraversalStatus.ESTOPPED if stopped else m.TraversalStatus.RUNNING,
        segment_id=segments[0].id,
        segment_count=len(segments),
        arc_length_m=1200.0,
        total_length_m=2400.0,
        speed_mps=0.0 if stopped else 1.0,
        coverage_pct=50.0,
        painted_ids=tuple(segment.id for segment in segments),
        painted_fraction=[0.5] * len(segments),
    )


def _messages() -> dict[topics.Topic, m.Message]:
    """The rest of what a robot says."""
    x_m = np.linspace(0.0, 0.1, 11)
    return {
        topics.CLOCK: m.Clock(clock=m.Time(sec=100)),
        topics.TRUE_COVERAGE: m.TrueCoverage(coverage_pct=50.0),
        topics.GNSS_STATUS: m.GnssStatus(fix=m.GnssStatus.FIXED, satellites=24, horizontal_accuracy_m=0.011),
        topics.PAINT: m.PaintMarks(segment_id="a", first_index=0, width_m=0.12, x_m=x_m, y_m=0.0 * x_m),
        topics.BATTERY: m.BatteryState(percentage=0.8),
        topics.SPRAYER: m.SprayerState(tank_l=12.0),
    }


def _diagnostics(name: str) -> m.DiagnosticArray:
    pairs = tuple(m.KeyValue(key=f"value_{number}", value=str(number)) for number in range(14))
    return m.DiagnosticArray(status=(m.DiagnosticStatus(name=name, message="ok", values=pairs),))


if __name__ == "__main__":
    talk(BusConfig.from_environment(sys.argv[1:]))
