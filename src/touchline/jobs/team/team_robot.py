"""Emulated robot of a team, run for several ticks at a time, with its true places in every tick."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.body_contacts import PRESSED
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import Guidance, TraversalStatus
from touchline.schemas.setup import Setup
from touchline.services.robot_sim import tick_log
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.packing import Payload
from touchline.services.robot_sim.telemetry import Telemetry

Floats = NDArray[np.float64]
Listener = Callable[[list[Payload]], None]

_SECOND_TICKS: Final = 100
_REST_MOST_TICKS: Final = 3000
_STOPPED: Final = (TraversalStatus.PAUSED, TraversalStatus.ABORTED, TraversalStatus.ESTOPPED)


class TeamRobot:
    """Emulated robot of a team.

    Attributes:
        emulator: The robot.
        telemetry: Its telemetry, if that is hashed or recorded.
        stopped: Why it stopped before the end, if it did.
        charge: Charge of its battery at the last whole second, as it tells so, a share of the whole.
    """

    def __init__(self, setup: Setup, *, hashed: bool, listener: Listener | None = None) -> None:
        """Place it at its scenario's start.

        Args:
            setup: The robot, its computer and its world.
            hashed: Whether to compute the hash of its session.
            listener: Called with all its telemetry.
        """
        self.emulator = Emulator(setup.vehicle, setup.scenario, setup.onboard)
        self.telemetry = Telemetry(self.emulator) if hashed or listener is not None else None
        self._listener = listener
        if self.telemetry is not None:
            self._publish([self.telemetry.setup(), *self.telemetry.standing(), *self.telemetry.awake()])
        self.stopped = ""
        self._battery_wh = setup.vehicle.body.battery_wh
        self.charge = self._told_charge(self.emulator.world.state.battery_wh)
        self._runner = FastRunner(self.emulator)
        self._rows = np.zeros((0, tick_log.columns(len(setup.vehicle.drive.actuators))))

    def begin_guided(self, *, plans: bool, margin_m: float = 0.0) -> None:
        """Start to be guided.

        Args:
            plans: Whether by plans instead of cells.
            margin_m: Distance by which it may be off that; 0: any.

        Raises:
            CommandRefused: Such a robot cannot be guided.
        """
        self._tell_held()
        self.emulator.begin_guided(plans=plans, margin_m=margin_m)
        if self.telemetry is not None:
            self._publish(self.telemetry.begin([]))

    def take_guidance(self, payloads: Guidance) -> None:
        """Take guidance from the coordinator; with a listener it counts among the robot's orders."""
        (self.emulator.onboard if self._listener is None else self.emulator).take_guidance(payloads)

    def touch(self) -> None:
        """Trigger its bumper from the next tick on, as over the bus."""
        self._tell_held()
        self.emulator.inject_fault(PRESSED)
        if self.telemetry is not None:
            self._publish(self.telemetry.news())

    def end(self) -> None:
        """Brake and end guidance."""
        self._tell_held()
        status = self.emulator.onboard.status
        if status.state in _STOPPED or self.emulator.onboard.must_stand:
            self.stopped = status.reason or "stopped"
        with suppress(CommandRefused):  # an emergency-stopped one stays so
            self.emulator.abort()
        if self.telemetry is not None:
            self._publish(self.telemetry.news())

    def _tell_held(self) -> None:
        if self.telemetry is None:
            return
        if self._listener is None:
            self.telemetry.only_hashed()
        else:
            self._listener(self.telemetry.told())

    def _publish(self, payloads: list[Payload]) -> None:
        if self._listener is not None:
            self._listener(payloads)

    @property
    def session_hash(self) -> str:
        """Return the session's hash, as the robot reports it, or up to now if it has not ended; empty if unknown."""
        if self.telemetry is None:
            return ""
        self._tell_held()
        final = self.telemetry.final
        return final.traversal.session_hash if final is not None else self.telemetry.digest.hexdigest()

    def drive(self, ticks: int, places: Floats) -> None:
        """Run some ticks.

        Args:
            ticks: How many.
            places: (ticks, 2) filled with its true place at the end of each (m, map frame).
        """
        if len(self._rows) < ticks:
            self._rows = np.zeros((ticks, self._rows.shape[1]))
        done = 0
        while done < ticks:
            done += self._step(ticks - done, places[done:])
            # The report is made where the traversal has ended, even if guidance goes on.
            if self.emulator.settled or self._is_due(heard=done == ticks):
                self._tell_held()

    def come_to_rest(self) -> None:
        """Run on, half a minute at most, until an ended traversal is no longer observed, as over the bus."""
        place = np.zeros((1, 2))
        for _ in range(_REST_MOST_TICKS):
            if not self.emulator.active:
                return
            self.drive(1, place)

    def _is_due(self, *, heard: bool) -> bool:
        """Return whether held telemetry is to be sent: at once to a listener, else when no more can be held."""
        return self.telemetry is not None and (self.telemetry.full or (heard and self._listener is not None))

    def _step(self, most: int, places: Floats) -> int:
        rows, telemetry = self._rows, self.telemetry
        if telemetry is not None:
            rows, most = telemetry.rows, telemetry.until_due(most)
        count = self._runner.step(most, rows)
        # All but the last are nominal ones, which are kept.
        places[: count - 1] = rows[: count - 1, tick_log.TRUTH : tick_log.TRUTH + 2]
        places[count - 1] = self.emulator.world.pose[:2]
        since = self.emulator.tick_count % _SECOND_TICKS
        if since < count:
            kept = rows[count - 1 - since, tick_log.BATTERY_WH] if since else self.emulator.world.state.battery_wh
            self.charge = self._told_charge(float(kept))
        if telemetry is not None:
            telemetry.hold(count)
        return count

    def _told_charge(self, left_wh: float) -> float:
        """Return a charge as its message has it, with single precision."""
        return float(np.float32(left_wh / self._battery_wh))
