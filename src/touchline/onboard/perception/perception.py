"""Perception of a robot: from the scans of its lidars to hits, tracks, and an occupancy grid that fades."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.estimation.filter import Estimator
from touchline.onboard.filter_model import EAST, HEADING, NORTH, RING, SPEED, YAW_RATE
from touchline.onboard.interface import TICK_S, TICKS_PER_S, AuxiliarySample
from touchline.onboard.perception.blind_sector import blind_sector_rad
from touchline.onboard.perception.clusters import UNIT, Clusters, form_clusters
from touchline.onboard.perception.fading_grid import REACH_M, FadingGrid
from touchline.onboard.perception.hits import NO_POINTS, Hits
from touchline.onboard.perception.hits_of_scan import gather_hits
from touchline.onboard.perception.known_outlines import KnownOutlines, Polygon, SeenOutline
from touchline.onboard.perception.past_scans import PastScans
from touchline.onboard.perception.scan import Beams, ScanFigures, place_beams
from touchline.onboard.perception.scan_memory import Rules, ScanMemory, confirm
from touchline.onboard.perception.tracks import TrackedThing, Tracks
from touchline.schemas.vehicles import ODOMETRY, Vehicle
from touchline.schemas.vehicles.lidar_spec import LidarSpec

Floats = NDArray[np.float64]

_CREEP_MPS: Final = 0.02
"""Speed below which a robot counts as standing."""
_SCANS_TO_CONFIRM: Final = 2
"""Scans after the first in which a far thing is confirmed, or not."""
_MARGIN_M: Final = 0.05
_MOST_UNSEEN: Final = 4000


class _Lidar:
    """A lidar: its figures, and what is kept of its last scans."""

    def __init__(self, number: int, spec: LidarSpec) -> None:
        self.number, self.spec, self.figures = number, spec, ScanFigures.of(spec)
        self.beams, self.memory = Beams.of(spec), ScanMemory.of(spec.beams)
        self.clusters, self.points_m = Clusters.of(spec.beams), np.empty((2 * spec.beams + _MOST_UNSEEN, 2))
        self.hits: Hits | None = None


class Perception:
    """Surroundings of a robot, as its lidars show them.

    Args:
        vehicle: The nominal robot, with one lidar or more.

    Attributes:
        grid: Occupancy of the surroundings, where the plan knows an outline.
        known: Outlines that the plan knows.
        too_late: Number of scans that were not used, because they came too late or before the estimator had started.
        way_m: Way that the robot has driven between scans.
        whole_scans: Whether all beams of `scans` are placed: those without a return are otherwise only if they matter.
    """

    def __init__(self, vehicle: Vehicle) -> None:
        drive, rules = vehicle.drive, vehicle.protection
        self._vehicle, self._lag_s = vehicle, drive_of(vehicle).lag_s
        self._thing_mps = rules.thing_speed_mps
        self._braking_mps2 = rules.hard_braking_mps2 or drive.max_acceleration_mps2
        self._body = np.array(vehicle.body.footprint_m)
        self._body_m = float(np.hypot(*self._body.T).max())
        self._occupied = rules.unseen == "occupied"
        self._absolute, self.whole_scans = vehicle.positioning != ODOMETRY, False
        self.restart()

    def restart(self, known: Sequence[Polygon] = ()) -> None:
        """Forget everything: the robot may have been carried elsewhere.

        Args:
            known: Corners (x, y) of the outlines that the plan knows, map frame [m].
        """
        specs = lidars_of(self._vehicle)
        self._lidars = {each.name: _Lidar(number, each) for number, each in enumerate(specs)}
        self._figures = np.zeros(len(specs), ScanFigures.dtype)
        for lidar in self._lidars.values():
            self._figures[lidar.number] = lidar.figures.array[0]
        self._past, self._all_round = PastScans.of([each.beams for each in specs]), blind_sector_rad(specs) == 0.0
        self._tracks, self.grid = Tracks(), FadingGrid()
        self._named: list[Polygon] = []
        self.known = KnownOutlines(())
        self.know(known)
        self._time_s, self._place, self.way_m, self.too_late = 0.0, (math.nan, math.nan), 0.0, 0

    def know(self, known: Sequence[Polygon]) -> None:
        """Replace the outlines that the plan knows, unless they are the same; arguments as in `restart`."""
        if list(known) != self._named:
            self._named, self.known = list(known), KnownOutlines(known)

    def takes(self, sample: AuxiliarySample) -> bool:
        """Return whether a sample is a scan of one of its lidars."""
        return sample.sensor in self._lidars

    def take(self, sample: AuxiliarySample, estimator: Estimator) -> list[int]:
        """Take a scan.

        Args:
            sample: Sample of a lidar that it `takes`.
            estimator: Estimator of the robot, with its states at the times of the beams.

        Returns:
            Outlines known to the plan, by their place in its list, that are found to be missing now.

        Raises:
            ValueError: The number of ranges is not that of the data sheet.
        """
        lidar, tick, ring = self._lidars[sample.sensor], estimator.times.tick, estimator.ring
        spec, beams, figures = lidar.spec, lidar.beams, lidar.figures.array
        ranges = np.asarray(sample.values, dtype=np.float64)
        if ranges.shape != (spec.beams,):
            raise ValueError(f"{sample.sensor}: {ranges.size} ranges in a scan; its data sheet has beams: {spec.beams}")
        oldest = math.floor((sample.stamp_s - spec.scan_s) * TICKS_PER_S + 1e-6)
        newest = math.floor(sample.stamp_s * TICKS_PER_S + 1e-6)
        if not estimator.started or not max(estimator.times.first_tick, tick - RING + 2) <= oldest <= newest <= tick:
            self.too_late += 1
            return []
        beams.range_m[:] = ranges
        time_s = tick * TICK_S
        everywhere = self.whole_scans or self._occupied or bool(self.known.outlines)
        returned = place_beams(figures, sample.stamp_s, ring.array, tick, self._body, everywhere, beams)
        state = estimator.state.tolist()
        self._note_way(state[EAST], state[NORTH])
        near_m = self._near_m(state[SPEED], state[YAW_RATE], spec)
        error_m = self._error_m(estimator, spec, near_m, tick - oldest)
        self._time_s = time_s
        if not (returned or everywhere or lidar.memory.may_miss) and self._tracks.none:
            lidar.memory.take_nothing(lidar.number, beams, self._past)
            self.grid.enter(beams, 0.0, time_s, asked=False)
            lidar.hits = Hits(NO_POINTS, oldest, error_m)
            return []
        sigma_m = estimator.position_sigma_m if self._absolute else 0.0
        self.known.explain(beams, 3.0 * math.hypot(sigma_m, spec.sigma_m) + spec.systematic_m, time_s)
        rules = Rules(near_m, self._thing_mps, self._all_round)
        confirm(self._figures, lidar.number, beams, rules, self.way_m, lidar.memory, self._past)
        x, y = beams.rays[-1, :2].tolist()
        asked = self.known.any_near(x, y, REACH_M)
        self.grid.enter(beams, min(spec.dark_m, spec.max_m), time_s, asked=asked)
        form_clusters(figures, beams, UNIT, lidar.clusters)
        self._tracks.follow(lidar.clusters, sigma_m, time_s)
        lidar.hits = self._hits_of(lidar, oldest, error_m)
        return self.known.newly_missing(self.grid, time_s)

    @property
    def scans(self) -> list[tuple[LidarSpec, Beams]]:
        """Data sheet and last scan of every lidar that has made one."""
        return [(each.spec, each.beams) for each in self._lidars.values() if each.hits is not None]

    @property
    def hits(self) -> Hits | None:
        """Hits of the last scan of every lidar; None until each has made one."""
        each = [lidar.hits for lidar in self._lidars.values()]
        found = [hits for hits in each if hits is not None]
        if len(found) < len(each):
            return None
        if len(found) == 1:
            return found[0]
        moving = [hits.points_m[: len(hits.points_m) - hits.standing] for hits in found]
        standing = [hits.points_m[len(hits.points_m) - hits.standing :] for hits in found]
        return Hits(
            np.concatenate(moving + standing),
            min(hits.tick for hits in found),
            max(hits.error_m for hits in found),
            sum(hits.standing for hits in found),
            np.concatenate([hits.doubtful_m for hits in found]),
        )

    @property
    def tracks(self) -> list[TrackedThing]:
        """Things that the plan does not know, as they are expected to be at the last scan."""
        return self._tracks.at(self._time_s, _MARGIN_M)

    @property
    def seen_outlines(self) -> list[SeenOutline]:
        """Outlines known to the plan that were seen lately, or are missing."""
        return self.known.seen(self._time_s)

    def _note_way(self, east_m: float, north_m: float) -> None:
        moved_m = math.hypot(east_m - self._place[0], north_m - self._place[1])
        self.way_m += 0.0 if math.isnan(moved_m) else moved_m
        self._place = east_m, north_m

    def _near_m(self, speed_mps: float, yaw_rate_radps: float, spec: LidarSpec) -> float:
        """Return the range up to which a thing has to be believed at its first return.

        Farther away there is time for two more scans: braking from the speed that the robot can have by then, and what
        the thing itself moves meanwhile (docs/explanation/perception.md).
        """
        waiting_s = _SCANS_TO_CONFIRM / spec.rate_hz
        body_mps = abs(speed_mps) + abs(yaw_rate_radps) * self._body_m
        speed_mps = body_mps + self._vehicle.drive.max_acceleration_mps2 * waiting_s
        until_s = waiting_s + 1.0 / spec.rate_hz + spec.latency_s + 2.0 * TICK_S + self._lag_s
        braking_s = speed_mps / self._braking_mps2
        creep_s = self._lag_s * math.log(max(self._braking_mps2 * self._lag_s / _CREEP_MPS, 1.0))
        own_m = speed_mps * (until_s + 0.5 * braking_s)
        return self._body_m + own_m + self._thing_mps * (until_s + braking_s + creep_s)

    def _error_m(self, estimator: Estimator, spec: LidarSpec, range_m: float, age_ticks: int) -> float:
        """Return the bound on the error of a return at this range, relative to the robot until the next scan.

        Since the scan the robot's speed and yaw rate have been as uncertain as they are now. Fixes may correct the pose
        by as much as its σ; with odometry alone nothing corrects it.
        """
        variances = estimator.covariance.diagonal().tolist()
        age_s = age_ticks * TICK_S + 1.0 / spec.rate_hz
        place, turn = variances[SPEED] * age_s**2, variances[YAW_RATE] * age_s**2
        if self._absolute:
            place, turn = place + max(variances[EAST], variances[NORTH]), turn + variances[HEADING]
        noise_m = spec.sigma_m + spec.sigma_relative * range_m
        bearing = spec.beam_rad**2 / 12.0
        sigma_m = math.sqrt(noise_m**2 + place + range_m**2 * (turn + bearing))
        # A thing may reach beyond its last return almost to the next beam.
        return 3.0 * sigma_m + spec.systematic_m + range_m * spec.step_rad

    def _hits_of(self, lidar: _Lidar, oldest: int, error_m: float) -> Hits:
        points, most_unseen = lidar.points_m, _MOST_UNSEEN if self._occupied else 0
        count, total, end = gather_hits(lidar.figures.array, lidar.beams, lidar.memory, most_unseen, points)
        return Hits(points[:total].copy(), oldest, error_m, total - count, points[total:end].copy())


def lidars_of(vehicle: Vehicle) -> list[LidarSpec]:
    """Return the lidars among a vehicle's sensors."""
    return [each for each in vehicle.sensors if isinstance(each, LidarSpec)]
