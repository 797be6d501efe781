"""An onboard computer that plays a script, for tests of everything round it."""

from itertools import pairwise

import numpy as np

from tests.two_wheels import STANDSTILL
from touchline.onboard.control.follower import Asking
from touchline.onboard.interface import (
    Command,
    Consistency,
    Estimate,
    OnboardEvent,
    PaintBelief,
    SensorFrame,
    Status,
)
from touchline.schemas.curves import Curve
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import Actuation, TraversalStatus
from touchline.schemas.trajectories import assemble, segment, velocity


def trajectory(curves, sprayed, ids=None, directions=None, speed_mps=1.0):
    """A Trajectory of `curves` from rest to rest; `sprayed` says for each whether the valve is open."""
    at, switches = 0.0, []
    for curve, on in zip(curves, sprayed, strict=True):
        switches.append((at, Actuation.DISC_SPRAY if on else Actuation.NONE))
        at += curve.length_m
    ids = ids or [f"s{i}" for i in range(len(curves))]
    directions = directions or [1] * len(curves)
    return assemble(
        [segment(*row) for row in zip(ids, curves, directions, strict=True)],
        switches,
        (velocity(s, v) for s, v in ((0.0, 0.0), (0.5, speed_mps), (at - 0.5, speed_mps), (at, 0.0))),
    )


def along_x(*ends_m, sprayed, ids=None, speed_mps=1.0):
    """A trajectory along the x axis, in pieces from each of these ends to the next."""
    curves = [Curve.from_line((a, 0), (b, 0)) for a, b in pairwise(ends_m)]
    return trajectory(curves, sprayed, ids, speed_mps=speed_mps)


class ScriptedOnboard:
    """Plays `script(tick since start) -> Command | None`; None ends the traversal."""

    def __init__(self, script):
        self._script = script
        self._played = 0
        self._events = []
        self.state = TraversalStatus.IDLE
        self.consistency = Consistency()
        self.estimate = Estimate(0.0, 0.0, 0.0, 0.0, 0.0, np.zeros(9), np.zeros(4))

    @property
    def status(self):
        return Status(state=self.state, segment_id="s0", segment_count=1, elapsed_s=self._played / 100)

    checkpoint = None
    perception = None
    warning = None
    lateral_error_m = 0.0
    spraying = False
    painted = PaintBelief()

    @property
    def guided(self):
        return False

    @property
    def whereabouts(self):
        return None

    @property
    def plan_state(self):
        return None

    def check_load(self):
        if self.state == TraversalStatus.RUNNING:
            raise CommandRefused("a traversal is under way")

    def prepare(self, _trajectory, _boundary=(), _obstacles=()):
        return None

    def take(self, _course, _resume=None):
        self.state, self._played = TraversalStatus.READY, 0
        return 1.0

    def start(self):
        if self.state != TraversalStatus.READY:
            raise CommandRefused("nothing is loaded")
        self.state = TraversalStatus.RUNNING
        self._events.append(OnboardEvent(0, "started", "started"))

    def pause(self):
        self.state = TraversalStatus.PAUSED

    def resume(self):
        self.state = TraversalStatus.RUNNING

    def abort(self, _reason=""):
        self.state = TraversalStatus.ABORTED

    def estop(self, _reason="emergency stop"):
        self.state = TraversalStatus.ESTOPPED

    def reset(self):
        self.state = TraversalStatus.IDLE

    def link_lost(self):
        self.state = TraversalStatus.PAUSED

    follower = None

    def perceive(self, frame: SensorFrame) -> None:
        pass

    def decide(self, _tick: int) -> Asking[Command]:
        yield from ()  # asks nobody
        if self.state != TraversalStatus.RUNNING:
            return STANDSTILL
        command = self._script(self._played)
        self._played += 1
        if command is None:
            self.state = TraversalStatus.DONE
            return STANDSTILL
        return command

    def take_events(self):
        events, self._events = self._events, []
        return events


def line_script(tick):
    """0.5 s at rest, 12 s at 1 m/s with paint from second 2 to second 10."""
    if tick >= 1250:
        return None
    return Command((10.0, 10.0), 200 <= tick < 1000, 150 <= tick < 1050) if tick >= 50 else STANDSTILL
