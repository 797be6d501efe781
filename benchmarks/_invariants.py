"""Random fault timelines on a short plan, with an operator who resumes and resets, and what must always hold."""

from __future__ import annotations

import json
import random
from contextlib import suppress
from typing import Any, Final

from touchline.onboard.estimation.tail import CONTRADICTED
from touchline.onboard.executive.localization_monitor import MAX_NIS
from touchline.schemas.curves import Curve
from touchline.schemas.errors import CommandRefused
from touchline.schemas.faults import Fault, parse_fault
from touchline.schemas.messages import Actuation, Trajectory, TraversalStatus
from touchline.schemas.onboard import FenceLimits, Follower, OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.trajectories import assemble, segment, velocity
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import UNLOGGED, FastRunner
from touchline.services.robot_sim.paint import projection

RUNNING, PAUSED, ESTOPPED = TraversalStatus.RUNNING, TraversalStatus.PAUSED, TraversalStatus.ESTOPPED
SPRAYED: Final = ((3.0, 8.0), (11.0, 14.0))
LENGTH_M: Final = 16.0
LIMIT_TICKS: Final = 9000
OPERATOR_TICKS: Final = 205
PATIENCE_TICKS: Final = 300
"""After which the operator resets or resumes."""
FENCE_TICKS: Final = 21
CLOSING_TICKS: Final = 4
"""The valve's delay."""
SLACK_M: Final = 0.025
"""Distance driven in a tick, and displacement of the command by the valve's delays."""
POSITION_FAULTS: Final = frozenset(("gnss-wrong-fix", "clock-skew", "gnss-degraded", "corrections-lost", "gnss-noisy"))

_CHOICES: Final[dict[str, dict[str, tuple[Any, ...]]]] = {
    "gnss-outage": {},
    "gnss-degraded": {"fix": ("single", "float"), "claimed_m": (None, 0.02)},
    "corrections-lost": {},
    "gnss-wrong-fix": {"east_m": (-0.5, 0.1, 0.3), "north_m": (0.0, 0.15, -1.0)},
    "gnss-noisy": {"white_m": (0.02, 0.2), "honest": (True, False)},
    "messages-late": {"sensor": ("gnss", "imu", "magnetometer", "encoder"), "delay_s": (0.02, 0.2, 0.8)},
    "messages-duplicated": {"sensor": ("gnss", "imu", "magnetometer", "encoder"), "after_s": (0.0, 0.3)},
    "messages-reordered": {"sensor": ("gnss", "imu", "magnetometer", "encoder"), "spread_s": (0.05, 0.4)},
    "messages-lost": {"sensor": ("gnss", "imu", "magnetometer", "encoder"), "share": (0.3, 1.0)},
    "clock-skew": {"offset_s": (-0.2, 0.05, 0.3), "drift_ppm": (0.0, 1000.0)},
    "imu-bias": {"gyro_radps": (-0.05, 0.02), "accel_mps2": (0.0, 1.0)},
    "imu-noisy": {},
    "imu-stuck": {},
    "magnetic-disturbance": {"east_t": (1e-5, -5e-5)},
    "encoder-dropout": {"actuator": ("left", "right", "all")},
    "wheel-blocked": {"actuator": ("left", "right", "all")},
    "wheel-slip": {"actuator": ("left", "all"), "share": (0.1, 0.5, 0.9)},
    "motor-weak": {"actuator": ("left", "all"), "share": (0.0, 0.3)},
    "valve-stuck": {"position": ("open", "closed")},
    "disc-stuck": {"position": ("up", "down")},
    "nozzle-clogged": {"share": (0.0, 0.5)},
    "bumper": {},
    "battery-low": {},
    "tank-empty": {},
    "operator-lost": {},
}


def fault(kind: str, **fields: Any) -> Fault:
    """A fault of this kind."""
    return parse_fault(
        json.dumps({"kind": kind, **{name: value for name, value in fields.items() if value is not None}})
    )


def timeline(seed: int) -> tuple[Fault, ...]:
    """One to five random faults, all of which pass."""
    draw = random.Random(seed)
    faults = []
    for _ in range(draw.randint(1, 5)):
        kind = draw.choice(sorted(_CHOICES))
        fields = {name: draw.choice(values) for name, values in _CHOICES[kind].items()}
        start, lasts = round(draw.uniform(0.5, 22.0), 2), round(draw.choice((0.05, 0.5, 3.0, 8.0)), 2)
        faults.append(fault(kind, start_s=start, duration_s=lasts, **fields))
    return tuple(faults)


def orders(seed: int) -> dict[int, str]:
    """Unprovoked orders of the operator, by tick."""
    draw = random.Random(-1 - seed)
    return {draw.randint(50, 2200): draw.choice(("pause", "estop", "link_lost")) for _ in range(draw.randint(0, 2))}


def limits(seed: int) -> FenceLimits:
    """A fence that is close enough to be met, every fourth time."""
    return FenceLimits(margin_m=0.02) if seed % 4 == 0 else FenceLimits()


def plan() -> Trajectory:
    """A line of 5 m, a bend to the left, and a line of 3 m, at 1 m/s."""
    curves = [Curve(0.0, 0.0, 0.3, 0.0, 8.0)]
    for curvature, length in ((0.35, 3.0), (0.0, 5.0)):
        x, y, heading = curves[-1].end
        curves.append(Curve(x, y, heading, curvature, length))
    switches = [(0.0, Actuation.NONE)]
    for start, end in SPRAYED:
        switches += [(start, Actuation.DISC_SPRAY), (end, Actuation.NONE)]
    speeds = ((0.0, 0.0), (0.5, 1.0), (LENGTH_M - 0.5, 1.0), (LENGTH_M, 0.0))
    return assemble(
        (segment(f"s{i}", curve) for i, curve in enumerate(curves)), switches, (velocity(s, v) for s, v in speeds)
    )


class Broken(AssertionError):
    """An invariant does not hold."""


class Guarded:
    """An emulator that is checked while it drives, and an operator who helps it on.

    Args:
        faults: The timeline.
        seed: Of the noise.
        patient: Whether there is an operator who resumes and resets.
        orders: What else the operator does, by tick.
        fence: Of the robot's computer.
        look_ticks: From one check to the next at most, in ticks in which nothing has to be decided; all others are
            checked.
    """

    def __init__(
        self,
        faults: tuple[Fault, ...],
        seed: int = 1,
        follower: Follower = "mpc",
        patient: bool = True,
        orders: dict[int, str] | None = None,
        fence: FenceLimits | None = None,
        look_ticks: int = 1,
    ) -> None:
        """Load and start the plan."""
        fence = fence or FenceLimits()
        scenario = Scenario(seed=seed, faults=faults)
        self.emulator = Emulator(Vehicle(), scenario, OnboardConfig(follower=follower, fence=fence))
        self._runner = FastRunner(self.emulator) if look_ticks > 1 else None
        self._orders, self._look_ticks = orders or {}, look_ticks
        self._closed = self._outside = 0
        self.emulator.load(plan())
        self.emulator.start()
        self.reasons: list[str] = []
        self._patient = patient
        self._kinds = {fault.kind for fault in faults}
        self._unheard = self._waiting = 0
        self._reset = False

    def run(self, limit: int = LIMIT_TICKS) -> int:
        """To the end or for `limit` ticks; returns the state."""
        emulator = self.emulator
        last = emulator.tick_count + limit
        while emulator.tick_count < last and (emulator.active or emulator.onboard.state == ESTOPPED):
            self._go_on(last)
        return emulator.onboard.state

    def _go_on(self, last_tick: int) -> None:
        """Some ticks, but none after the last, and a check."""
        emulator, first = self.emulator, self.emulator.tick_count
        order = self._orders.pop(first, "")
        if order:
            with suppress(CommandRefused):
                getattr(emulator, order)()
        before = emulator.onboard.state
        if self._runner is None:
            emulator.tick()
        else:
            next_order = min((tick for tick in self._orders if tick > first), default=last_tick)
            self._runner.step(min(self._look_ticks, last_tick - first, next_order - first), UNLOGGED)
        self._check(before, emulator.tick_count - first)

    def _check(self, before: int, ticks: int) -> None:
        """So many ticks after the robot was in the state `before`."""
        emulator = self.emulator
        status, command, frame = emulator.onboard._traversal, emulator.command, emulator.frame  # no time to the end
        if frame is not None and frame.tick != emulator.tick_count:
            frame = None  # in nominal ticks no bumper is pressed, and the operator is there
        if status.reason and (not self.reasons or self.reasons[-1] != status.reason):
            self.reasons.append(status.reason)
        self._unheard = 0 if frame is None or frame.operator_alive else self._unheard + 1
        limit = emulator.vehicle.drive.max_wheel_speed_radps * 1.001
        self._hold(all(abs(w) <= limit for w in command.actuators), f"wheel commands {command.actuators}")
        warning = emulator.onboard.warning
        warned = warning is not None and emulator.tick_count >= warning.earliest_tick
        if status.state == RUNNING and any(command.actuators):
            self._hold(warned, "moves without a warning")
        if status.state != RUNNING:
            self._hold(not command.valve and not command.disc, "valve or disc while not running")
        if status.state == ESTOPPED:
            self._hold(command.actuators == (0.0, 0.0), "wheels commanded while stopped")
        self._hold(before != ESTOPPED or status.state == ESTOPPED or self._reset, "left the emergency stop by itself")
        if frame is not None and frame.bumper:
            self._hold(status.state not in (RUNNING, PAUSED), "on with a pressed bumper")
        if self._unheard > OPERATOR_TICKS:
            self._hold(status.state != RUNNING, "running without an operator")
        self._closed = 0 if command.valve or command.valve_after_s > 0.0 else _longer(self._closed, ticks)
        if self._closed > CLOSING_TICKS and "valve-stuck" not in self._kinds:
            self._hold(not emulator.world.state.valve_open, "the valve stays open")
        self._check_fence(status.state, ticks)
        if command.valve:
            self._check_paint()
        self._reset = False
        if self._patient:
            self._help()

    def _check_fence(self, state: int, ticks: int) -> None:
        onboard = self.emulator.onboard
        fence, estimator = onboard._hazards.fence, onboard._estimator
        if not estimator.started:
            return
        assert fence is not None, "made with the job"
        allowed_m = fence.margin_m + 3.0 * estimator.heading_sigma_rad * fence.radius_m
        beyond = fence.beyond_m(*estimator.state[:3].tolist()) > allowed_m
        self._outside = _longer(self._outside, ticks) if beyond and state in (RUNNING, PAUSED) else 0
        self._hold(self._outside < FENCE_TICKS, "on beyond the fence")

    def _check_paint(self) -> None:
        onboard = self.emulator.onboard
        estimator = onboard._estimator
        nozzle_m = onboard._traversal.job._nozzle_m()  # type: ignore[union-attr]
        fix, sigma = estimator.last_fix, estimator.position_sigma_m
        self._hold(fix is not None and fix.fix == 3 and fix.correction_age_s <= 10.0, "paint without an RTK fix")
        assert fix is not None
        self._hold(self.emulator.time_s - fix.stamp_s <= 0.51 or "clock-skew" in self._kinds, "paint on an old fix")
        self._hold(sigma <= 0.025, "paint without a position")
        counters = estimator.counters
        self._hold(counters.fix_doubt < CONTRADICTED, "paint against the fixes")
        self._hold(counters.fix_nis_recent <= MAX_NIS, "paint on scattering fixes")
        self._hold(counters.encoders_rejected_recent <= 0.5, "paint on slipping wheels")
        inside = any(start - SLACK_M <= nozzle_m <= end + SLACK_M for start, end in SPRAYED)
        self._hold(inside, "paint outside what the plan sprays")
        if not self._kinds & POSITION_FAULTS:
            lateral = abs(self.emulator.work.ledger.lateral_m)
            self._hold(lateral < 0.08, f"paint {lateral:.3f} m beside its line")
            points = self.emulator.work.ledger.rows(0)
            astray = len(points) and points[-1, projection.POINT_TARGET] == -1.0
            self._hold(not astray or "valve-stuck" in self._kinds, "paint that belongs to no line")

    def _help(self) -> None:
        onboard = self.emulator.onboard
        self._waiting = self._waiting + 1 if onboard.state in (PAUSED, ESTOPPED) else 0
        if self._waiting < PATIENCE_TICKS:
            return
        self._waiting = 0
        try:
            if onboard.state == ESTOPPED:
                self._reset = True
                self.emulator.reset()
            else:
                self.emulator.resume()
        except CommandRefused as refusal:
            self._hold(bool(str(refusal)), "a refusal without a reason")

    def _hold(self, well: bool, what: str) -> None:
        if not well:
            emulator = self.emulator
            raise Broken(f"{what} at {emulator.time_s:.2f} s: {emulator.onboard.status}, {emulator.scenario.faults}")


def _longer(count: int, ticks: int) -> int:
    """Ticks for which a present condition has held, `ticks` after it had held for `count`; 1 if it had not."""
    return count + ticks if count else 1


def random_run(seed: int, look_ticks: int = 1) -> Guarded:
    """A run with random faults and orders; see `Guarded`."""
    follower: Follower = "pure-pursuit" if seed % 3 == 0 else "mpc"
    return Guarded(
        timeline(seed), seed % 7 + 1, follower, orders=orders(seed), fence=limits(seed), look_ticks=look_ticks
    )
