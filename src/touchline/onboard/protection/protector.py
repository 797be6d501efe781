"""Protection of one robot: what its lidars have seen, how fast it may drive among it, and when it has to stand."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from touchline.core.physical_constants import GRAVITY_MPS2
from touchline.core.records import Record
from touchline.onboard import filter_model as m
from touchline.onboard.computer_state import NEVER_SCANNED, ComputerState
from touchline.onboard.drives.onboard_drive import OnboardDrive
from touchline.onboard.estimation.filter_tick import speed_now_mps
from touchline.onboard.interface import TICK_S, TICKS_PER_S
from touchline.onboard.perception.blind_sector import blind_sector_rad
from touchline.onboard.perception.hits import Hits
from touchline.onboard.protection.clearance import HitArrays, clearance
from touchline.onboard.protection.measured_way import HitsInReach, measure_way
from touchline.onboard.protection.protection_zones import ProtectionZones, zones_of
from touchline.onboard.protection.stopping import stopping_m, stopping_with
from touchline.onboard.protection.way import CLEAR, NOT_LAID, SILENT, TURN, watch_way
from touchline.schemas.vehicles import LidarSpec, Vehicle

Floats = NDArray[np.float64]

SPEED_SLACK: Final = 1.1
"""Factor on the planned speeds up to which followers may drive to catch up."""
CLEAR_TICKS: Final = TICKS_PER_S
"""Time for which the way has to be clear before the robot warns that it goes on."""
RESTART_MPS: Final = 0.1
RESTART_M: Final = 0.1
"""Speed and way that have to be free before it does, so that it does not set off for a centimetre."""
SILENT_LIMIT_TICKS: Final = round(0.25 * TICKS_PER_S)
"""Age of the hits beyond which the lidar counts as silent, unless it is always that slow."""
LATE_SCAN_TICKS: Final = 5
"""Delay of a scan that a slow lidar may have."""
STOP_TOLERANCE: Final = 1.05
STOP_TOLERANCE_M: Final = 0.02
"""A stop took longer than predicted beyond this multiple of the distance, and this."""
STOP_FROM_MPS: Final = 0.3
"""Speed from which a stop says something about the ground."""
LEAST_BRAKING_MPS2: Final = 0.05
MOVED_M: Final = 0.1
"""A thing moves if no hit was that near to it MOVED_SCANS ago, but for twice the error of hits."""
MOVED_SCANS: Final = 10
MOVED_ERROR_M: Final = 0.06
"""Largest error of hits that counts there: what is not known of the pose is the same in both scans."""
_NO_HITS: Final = HitArrays(*(np.empty((0, 2)) for _ in range(3)))


class Blocked(NamedTuple):
    """Thing in the robot's way.

    Attributes:
        since_tick: Tick since which the robot may not move for it.
        distance_m: Its distance from the body.
        place_m: East and north of its point that is in the way, map frame.
        moving: True if it moves.
        too_near: True if the robot may not move at all, wherever to, while something that may move is as near.
    """

    since_tick: int
    distance_m: float
    place_m: tuple[float, float]
    moving: bool
    too_near: bool


class ProtectionMemory(Record):
    """Memory from job to job: what a robot has learned and told since it was switched on."""

    hard_mps2: float
    """Deceleration of the hardest stop, as far as the drive goes; less once a stop has taken longer than predicted."""
    told_left_out: bool
    """True once the cases that the promise of no contact leaves out were reported."""
    told_too_fast: bool
    """True once something was reported that came too fast."""
    clear_tick: int
    """Last tick in which the way of a pausing robot was not clear."""


class Driver(Protocol):
    """Part of a job that knows the way to come."""

    @property
    def way(self) -> tuple[int, bool]:
        """Leg that the robot is on, and whether it returns along it."""
        ...

    @property
    def returns(self) -> bool:
        """True if the robot, when it goes on after a stop, first returns along its path."""
        ...

    @property
    def standing(self) -> bool:
        """True if the robot is neither commanded to move nor moves."""
        ...

    def lay_way(self, *, back: bool) -> None:
        """Lay the way to come in the computer's state, as the kernels of `protection.way` do.

        Args:
            back: True for the way back along the leg.
        """
        ...


class Protector:
    """Rule that lets a robot move only where it can stop before it touches anything.

    Attributes:
        on: True if the robot has a lidar; without one nothing is watched.
        memory: What persists from job to job.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        grip: float,
        drive: OnboardDrive,
        computer: ComputerState,
        tell: Callable[[str], None],
    ) -> None:
        """Begin without a scan.

        Args:
            vehicle: The nominal robot.
            grip: Largest force of a tyre over its load on the robot's ground.
            drive: Onboard side of the drive.
            computer: State of the computer; its way is reset.
            tell: Function that reports a text to the operator.
        """
        lidars = [each for each in vehicle.sensors if isinstance(each, LidarSpec)]
        self.on, self.memory = bool(lidars), ProtectionMemory()
        self._computer, self._way, self._tell, self._rules = computer, computer.way, tell, vehicle.protection
        self._hits = Hits(np.zeros((0, 2)), NEVER_SCANNED, 0.0)
        self._earlier: list[Floats] = []
        self._reach = HitsInReach.sized(0)
        self._driver: Driver | None = None
        self._laid: tuple[int, bool] | None = None
        self._blocked: Blocked | None = None
        self._checked_tick = NEVER_SCANNED
        self._why = ""
        self._braking_from_mps = self._braked_m = 0.0
        if not self.on:
            return
        self._body: Floats = np.array(vehicle.body.footprint_m, dtype=np.float64)
        radius_m = float(np.hypot(*self._body.T).max())
        hardest = drive.moves_mps(drive.max_step) / TICK_S
        self.memory.hard_mps2 = min(hardest, self._rules.hard_braking_mps2 or math.inf)
        self._ground_mps2 = drive.driven_share * grip * GRAVITY_MPS2
        self._grip, self._blind_rad = grip, blind_sector_rad(lidars)
        late_s = max(each.scan_s + each.latency_s + 1.0 / each.rate_hz for each in lidars)
        spin_radps2 = drive.spin_acceleration_radps2()
        planned_mps2 = vehicle.drive.max_acceleration_mps2
        way = self._way
        way.reset(
            on=True,
            margin_m=self._rules.margin_m,
            thing_mps=self._rules.thing_speed_mps if self._rules.mode == "passive" else 0.0,
            radius_m=radius_m,
            planned_mps2=planned_mps2,
            braking_mps2=max(min(self.memory.hard_mps2, self._ground_mps2), LEAST_BRAKING_MPS2),
            lag_s=drive.lag_s,
            late_ticks=math.ceil(late_s * TICKS_PER_S),
            lever_m=planned_mps2 / spin_radps2 if spin_radps2 > 0.0 else 1.0,
        )
        way.silent_ticks = max(SILENT_LIMIT_TICKS, way.late_ticks + LATE_SCAN_TICKS)
        planned_mps = max(vehicle.drive.transit_speed_mps, vehicle.tool.work_speed_mps)
        self._wanted_mps, self._seen_m = SPEED_SLACK * planned_mps, min(each.dark_m for each in lidars) - radius_m
        self._set_speeds()

    @property
    def sees_all_round(self) -> bool:
        """True if the lidars leave no direction out."""
        return self.on and self._blind_rad == 0.0

    @property
    def watches_all_round(self) -> bool:
        """True if the lidars see all round and things may move: nobody can be near when the robot moves off."""
        return self.sees_all_round and self._way.thing_mps > 0.0

    @property
    def left_out(self) -> str:
        """Cases that the promise of no contact leaves out, in words."""
        rules, way = self._rules, self._way
        texts = []
        if way.thing_mps > 0.0:
            texts.append(f"things that move faster than {way.thing_mps:g} m/s")
        else:
            texts.append("things that move (protection.mode is protect)")
        if self._blind_rad > 0.0:
            texts.append(f"{math.degrees(self._blind_rad):.0f}° round the robot that no lidar sees")
        if rules.unseen == "ignored":
            texts.append("what comes from behind other things (protection.unseen is ignored)")
        texts.append(f"ground with less grip than {self._grip:g} (drive.grip)")
        return "protected against contact while moving, except: " + "; ".join(texts)

    @property
    def blocked(self) -> Blocked | None:
        """Thing in the way; None if the robot may move, or its lidar is silent."""
        return self._blocked

    @property
    def braking_mps2(self) -> float:
        """Deceleration of a protective stop that the robot counts on."""
        return self._way.braking_mps2

    @property
    def error_m(self) -> float:
        """Bound on the error of the hits that the robot counts on."""
        return self._way.error_m

    @property
    def zones(self) -> ProtectionZones | None:
        """Zones of the robot as it is now; None if nothing is watched."""
        return zones_of(self._computer, self._body) if self.on else None

    def take(self, hits: Hits) -> None:
        """Take the hits of the newest scan; call it before the first tick that follows their arrival.

        Args:
            hits: Points at which something is, or may be; hits older than the present ones are dropped.

        Raises:
            ValueError: Points are not (n, 2), a number is not finite, or an error or count is negative.
        """
        if not self.on or hits.tick < self._hits.tick:
            return
        _check(hits)
        if self._driver is not None and self._laid is not None:
            self._check_speed_of_things(hits)
        self._earlier = [*self._earlier[1 - MOVED_SCANS :], self._hits.points_m]
        self._hits = hits
        self._way.scan_tick, self._way.error_m = hits.tick, hits.error_m
        if self._driver is not None and self._laid is not None:
            self._measure(self._driver, back=self._laid[1])

    @property
    def kept_hits(self) -> dict[str, NDArray[Any]]:
        """Arrays of the hits of the last scans, by names: with `memory` all that matters to the next job."""
        hits = self._hits
        figures = np.array([hits.tick, hits.error_m, hits.standing], dtype=np.float64)
        earlier = {f"earlier{n}_m": points for n, points in enumerate(self._earlier)}
        return {"figures": figures, "points_m": hits.points_m, "doubtful_m": hits.doubtful_m, **earlier}

    def restore_hits(self, kept: Mapping[str, NDArray[Any]]) -> None:
        """Restore hits as of `kept_hits`.

        Raises:
            ValueError, KeyError, OverflowError: They are not valid.
        """
        tick, error_m, standing = kept["figures"].tolist()
        points, doubtful, *earlier = (
            kept[name].astype(np.float64)
            for name in ("points_m", "doubtful_m", *(f"earlier{n}_m" for n in range(len(kept) - 3)))
        )
        hits = Hits(points, int(tick), error_m, int(standing), doubtful)
        for each in (hits, *(hits._replace(points_m=points, standing=0) for points in earlier)):
            _check(each)
        self._hits, self._earlier = hits, earlier
        self._way.scan_tick, self._way.error_m = hits.tick, hits.error_m

    def watch(self, driver: Driver) -> str:
        """Watch the way of a driving robot in this tick; return the reason why it may not move, "" if it may.

        Args:
            driver: Job of the robot.
        """
        if not self.on:
            return ""
        if not self.memory.told_left_out:
            self.memory.told_left_out = True
            self._tell(self.left_out)
        if self._driver is not driver or self._laid != driver.way or self._way.kind == NOT_LAID:
            self._driver = driver
            self._measure(driver, back=driver.way[1])
        watch_way(self._computer.array)
        return self._reason()

    def brake(self) -> None:
        """Begin a protective stop: the reference brakes as hard as drive and ground allow."""
        self._computer.leg.brake_mps2 = self._way.braking_mps2
        self._braking_from_mps, self._braked_m = self._speed_mps(), 0.0

    def let_go(self) -> None:
        """End a protective stop: the reference brakes as planned."""
        if self.on:
            self._computer.leg.brake_mps2 = self._way.planned_mps2
            self._blocked, self._braking_from_mps = None, 0.0

    def rest(self) -> None:
        """Stop watching, because the robot has no way to come."""
        self._driver = self._laid = None
        self._way.kind = NOT_LAID

    def against_going_on(self, driver: Driver) -> str:
        """Return the reason why a pausing robot may not move off, "" once its way has been clear for a while.

        Args:
            driver: Job of the robot.
        """
        if not self.on:
            return ""
        tick = self._computer.times.tick
        self._check_stop(driver)
        if self._checked_tick != self._hits.tick or tick - self._hits.tick > self._way.silent_ticks:
            self._checked_tick, self._driver = self._hits.tick, driver
            self._why = ""
            for back in (False, True) if driver.returns else (False,):
                self._measure(driver, back=back)
                watch_way(self._computer.array)
                self._why = self._reason() or self._no_room()
                if self._why:
                    break
        if self._why:
            self.memory.clear_tick = tick
            return self._why
        if tick - self.memory.clear_tick < CLEAR_TICKS:
            return "the way has just become clear"
        self._blocked = None
        return ""

    def _reason(self) -> str:
        way = self._way
        if way.blocked == CLEAR:
            return ""
        if way.blocked == SILENT:
            self._blocked = None
            return f"the lidar is silent: nothing from it for more than {way.silent_ticks * TICK_S:g} s"
        return self._in_the_way()

    def _no_room(self) -> str:
        """Return the reason why it is not worth to move off, "" if it is."""
        way, leg = self._way, self._computer.leg
        left_m = RESTART_M
        if way.kind != TURN and way.sense > 0.0 and leg.end_m > leg.arc_m:
            left_m = min(RESTART_M, leg.end_m - leg.arc_m)
        return self._in_the_way() if way.limit_mps < RESTART_MPS or way.stop_m < left_m else ""

    def _in_the_way(self) -> str:
        """Find what stands in the way; return a text about it."""
        way, points = self._way, self._hits.points_m
        tight = np.flatnonzero(way.nearest >= 0)
        if not len(tight):
            self._blocked = None
            return "something that is no longer seen is in the way"
        beyond = tight[way.ahead_m[tight] > way.stop_m]
        first = int(beyond[0] if len(beyond) else tight[np.argmin(way.clear_m[tight])])
        place = self._reach.place(int(way.nearest[first]))
        distance_m, _ = clearance(self._body, way.radius_m, self._pose(), place[None], math.inf)
        earlier = self._earlier[0] if len(self._earlier) == MOVED_SCANS else points
        far_m = MOVED_M + 2.0 * min(way.error_m, MOVED_ERROR_M)
        moving = bool(len(earlier) == 0 or np.hypot(*(earlier - place).T).min() > far_m)
        since_tick = self._blocked.since_tick if self._blocked is not None else self._computer.times.tick
        kept_m = way.margin_m + way.error_m + way.thing_mps * (way.late_ticks * TICK_S + way.reaction_s + way.creep_s)
        beside_m = max(float(way.clear_m[0] + way.slack_m[0]), 0.0)
        too_near = way.thing_mps > 0.0 and beside_m < kept_m
        self._blocked = Blocked(since_tick, max(distance_m, 0.0), (float(place[0]), float(place[1])), moving, too_near)
        if too_near and not moving:
            return (
                f"something that may move is {beside_m:.1f} m from the robot, which needs {kept_m:.1f} m: move either, "
                "or name it in the plan"
            )
        does = "moves" if moving else "stands"
        return f"something that {does} is in the way, {self._blocked.distance_m:.1f} m from the robot"

    def _measure(self, driver: Driver, *, back: bool) -> None:
        """Lay the way to come and measure the clearances along it."""
        hits = self._hits
        driver.lay_way(back=back)
        self._laid = driver.way[0], back
        self._set_braking()
        points, moving = hits.points_m, len(hits.points_m) - hits.standing
        most = max(len(points), len(hits.doubtful_m))
        if most > len(self._reach.hits.moving_m):
            self._reach = HitsInReach.sized(2 * most)
        parts = _NO_HITS
        if most:
            parts = HitArrays(*map(np.ascontiguousarray, (points[:moving], points[moving:], hits.doubtful_m)))
        measure_way(self._computer.array, self._body, parts, self._reach)

    def _set_braking(self) -> None:
        """Set the deceleration that the ground gives where the way leads: less downhill."""
        way, learned = self._way, self._computer.filter.learned
        east, north = way.east_m[1] - way.east_m[0], way.north_m[1] - way.north_m[0]
        far_m = math.hypot(east, north)
        rise = (east * learned.rise_east_mps2 + north * learned.rise_north_mps2) / far_m if far_m > 0.0 else 0.0
        braking_mps2 = max(min(self.memory.hard_mps2, self._ground_mps2 + min(rise, 0.0)), LEAST_BRAKING_MPS2)
        if braking_mps2 != way.braking_mps2:
            way.braking_mps2 = braking_mps2
            self._set_speeds()

    def _set_speeds(self) -> None:
        """Set the highest speed, at which the robot stops for what it sees at its lidar's range, and the horizon."""
        way = self._way
        stopping = stopping_with(way.braking_mps2, way.lag_s)
        way.reaction_s, way.creep_s = stopping.reaction_s, stopping.creep_s
        way.lead_mps = way.braking_mps2 * TICK_S / -math.expm1(-TICK_S / max(way.lag_s, 1e-3))
        b, thing = way.braking_mps2, way.thing_mps
        reached = b * stopping.reaction_s + thing
        moved_m = thing * (way.late_ticks * TICK_S + stopping.reaction_s + stopping.creep_s)
        left_m = self._seen_m - way.margin_m - moved_m
        seen_mps = max(math.sqrt(reached * reached + 2.0 * b * max(left_m, 0.0)) - reached, 0.0)
        way.fastest_mps, way.free_mps = min(self._wanted_mps, seen_mps), math.inf
        if seen_mps < self._wanted_mps:
            way.free_mps = seen_mps
        planned_m = way.fastest_mps**2 / (2.0 * min(way.planned_mps2, b))
        until_s = stopping.reaction_s + way.silent_ticks * TICK_S
        way.horizon_m = max(planned_m, stopping_m(way.fastest_mps, stopping)) + way.fastest_mps * until_s

    def _check_stop(self, driver: Driver) -> None:
        """Compare a protective stop with its prediction, and count on less braking if it took longer."""
        if self._braking_from_mps < STOP_FROM_MPS:
            return
        if not driver.standing:
            self._braked_m += self._speed_mps() * TICK_S
            return
        way, speed = self._way, self._braking_from_mps
        stopping = stopping_with(way.braking_mps2, way.lag_s)
        predicted_m, self._braking_from_mps = stopping_m(speed, stopping), 0.0
        if self._braked_m <= STOP_TOLERANCE * predicted_m + STOP_TOLERANCE_M:
            return
        left_m = self._braked_m / STOP_TOLERANCE - speed * stopping.reaction_s
        self.memory.hard_mps2 = max(speed * speed / (2.0 * left_m), LEAST_BRAKING_MPS2)
        self._tell(
            f"a stop from {speed:.2f} m/s took {self._braked_m:.2f} m instead of {predicted_m:.2f} m; the robot counts "
            f"on a deceleration of {self.memory.hard_mps2:.1f} m/s² from now on"
        )

    def _check_speed_of_things(self, hits: Hits) -> None:
        """Report once if something came nearer than a thing of the allowed speed can have come since the last scan."""
        way = self._way
        if self.memory.told_too_fast or self._hits.tick == NEVER_SCANNED or not len(hits.points_m):
            return
        pose = self._pose()
        most_m = way.margin_m + way.thing_mps  # what is farther away after this matters little
        now_m, _ = clearance(self._body, way.radius_m, pose, hits.points_m, most_m)
        gone_m = way.thing_mps * (hits.tick - self._hits.tick) * TICK_S + self._hits.error_m + hits.error_m + MOVED_M
        before_m, _ = clearance(self._body, way.radius_m, pose, self._hits.points_m, most_m + gone_m)
        if now_m < most_m and now_m < before_m - gone_m:
            self.memory.told_too_fast = True
            self._tell(
                f"something came within {max(now_m, 0.0):.1f} m that moves faster than {way.thing_mps:g} m/s, or that "
                "the lidar did not see before; the robot is not protected against that"
            )

    def _pose(self) -> tuple[float, float, float]:
        x = self._computer.filter.states[self._computer.times.tick % m.RING]
        return float(x[m.EAST]), float(x[m.NORTH]), float(x[m.HEADING])

    def _speed_mps(self) -> float:
        return abs(float(speed_now_mps(self._computer.array)))


def _check(hits: Hits) -> None:
    for name, points in (("points_m", hits.points_m), ("doubtful_m", hits.doubtful_m)):
        if points.ndim != 2 or points.shape[1] != 2 or (len(points) and not np.isfinite(points).all()):
            raise ValueError(f"hits: {name} has the shape {points.shape}, or is not finite; give (n, 2) finite numbers")
    if not (math.isfinite(hits.error_m) and hits.error_m >= 0.0):
        raise ValueError(f"hits: error_m is {hits.error_m}; give a bound of at least 0")
    if not 0 <= hits.standing <= len(hits.points_m):
        raise ValueError(f"hits: standing is {hits.standing} of {len(hits.points_m)} points")
