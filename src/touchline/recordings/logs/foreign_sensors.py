"""Sensors of a foreign log by its mapping: fixes, yaw rate and specific force, wheels, reference track."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from touchline.core.geodesy import local_frame, to_local
from touchline.recordings.logs.held_readings import between_changes, changes
from touchline.recordings.logs.log_table import Floats, LogContent, LogError
from touchline.recordings.logs.stream_quantities import Quantities
from touchline.recordings.logs.time_order import in_order
from touchline.schemas.errors import SpecError
from touchline.schemas.log_mapping import FIX_KINDS, FixSource, ImuSource, LogMapping, TrackSource, WheelSource
from touchline.schemas.scenario import Origin

FIXED, FLOAT, SINGLE, NONE = (FIX_KINDS.index(kind) for kind in ("fixed", "float", "single", "none"))
UNKNOWN_SIGMA_M = {FIXED: 0.01, FLOAT: 0.3, SINGLE: 2.5, NONE: 100.0}
"""1 σ per axis of fixes without a reported one."""
_GEODETIC = ("latitude_deg", "longitude_deg")
_MOST_DEG = dict(zip(_GEODETIC, (90.0, 360.0), strict=True))
_LOCAL = ("east_m", "north_m")
_MOST_FRAME_M = 1e6
_TURN_RAD = 2.01 * math.pi
_LEVER_M = 0.25  # distance at which a turn on the spot counts as motion


@dataclass(frozen=True)
class FixSeries:
    """Fixes in the order of their time of validity.

    Attributes:
        time_s: (n,) time of validity, log's clock.
        place_m: (n, 3) east, north, up of the antenna, map frame.
        sigma_m: (n,) reported σ per axis.
        fix: (n,) kind as in `GnssStatus`.
        satellites: (n,) used satellites.
        age_s: (n,) age of corrections.
    """

    time_s: Floats
    place_m: Floats
    sigma_m: Floats
    fix: NDArray[np.int64]
    satellites: NDArray[np.int64]
    age_s: Floats


@dataclass(frozen=True)
class RateSeries:
    """Readings over time.

    Attributes:
        time_s: (n,) log's clock, increasing.
        values: (n, k).
        cumulative: Whether they are totals, whose differences the ticks get, and not rates.
    """

    time_s: Floats
    values: Floats
    cumulative: bool = False


@dataclass(frozen=True)
class TrackSeries:
    """Track of the robot by another instrument.

    Attributes:
        time_s: (n,) increasing.
        place_m: (n, 3) east, north, up.
        heading_rad: (n,) NaN where unknown.
        of_antenna: Whether it is the antenna's track, and not the body origin's.
    """

    time_s: Floats
    place_m: Floats
    heading_rad: Floats
    of_antenna: bool = False


@dataclass
class ForeignSensors:
    """Log converted to the sensors of a robot; a part that it lacks is None.

    Attributes:
        origin: Origin of the map frame.
        turn: (n, 1) angle turned to the left [rad], total, or yaw rate [rad/s].
        force: (n, 3) specific force forward, to the left and up [m/s²].
        rates: (n, 3) angular rates about the same axes [rad/s].
        travel: (n, 2) distance [m] and turn [rad] by the wheels, total, or their rates.
        joints: (n, 2) angles of the left and right wheel [rad], total.
        remarks: What was left out or assumed, a line each.
        columns: Quantities that fixes, IMU and wheels were taken from, by the part of the mapping.
    """

    origin: Origin
    fixes: FixSeries | None = None
    turn: RateSeries | None = None
    force: RateSeries | None = None
    rates: RateSeries | None = None
    travel: RateSeries | None = None
    joints: RateSeries | None = None
    reference: TrackSeries | None = None
    remarks: list[str] = field(default_factory=list)
    columns: dict[str, Sequence[str]] = field(default_factory=dict)


def sensors_of(mapping: LogMapping, content: LogContent) -> ForeignSensors:
    """Return the sensors of a log.

    Raises:
        SpecError: The mapping does not fit the log.
        LogError: The log lacks what the mapping asks for.
    """
    if mapping.fixes is None and mapping.wheels is None and mapping.imu is None:
        raise SpecError("mapping", "fixes", "is missing, as are imu and wheels", "name the stream of one at least")
    found = ForeignSensors(mapping.origin or _first_place(mapping, content) or Origin())
    place = _placing(found.origin)
    if mapping.fixes is not None:
        found.fixes = _fixes(mapping.fixes, content, place, found.remarks)
        found.columns["fixes"] = Quantities("fixes", mapping.fixes, content).require(_GEODETIC, _LOCAL)
    if mapping.imu is not None:
        _take_imu(mapping.imu, content, found)
    if mapping.wheels is not None:
        _take_wheels(mapping.wheels, content, found)
    if mapping.reference is not None:
        found.reference = _track(mapping.reference, content, place, found.remarks)
    return found


def _first_place(mapping: LogMapping, content: LogContent) -> Origin | None:
    """Return the first geodetic position in the log."""
    for part, source in (("fixes", mapping.fixes), ("reference", mapping.reference)):
        if source is None:
            continue
        quantities = Quantities(part, source, content)
        if not quantities.known(*_GEODETIC):
            continue
        latitude, longitude = (quantities.get(name) for name in _GEODETIC)
        good = np.flatnonzero(_on_earth(latitude, longitude) & (np.abs(latitude) <= 89))
        if len(good):
            altitude = quantities.get("altitude_m")[good[0]]
            height_m = float(altitude) if math.isfinite(altitude) and -500 <= altitude <= 9000 else 0.0
            return Origin(
                latitude_deg=float(latitude[good[0]]), longitude_deg=float(longitude[good[0]]), altitude_m=height_m
            )
    return None


def _on_earth(latitude: Floats, longitude: Floats) -> NDArray[np.bool_]:
    """Return where there is a position; receivers without one report 0, 0."""
    there = np.isfinite(latitude) & np.isfinite(longitude) & (np.abs(latitude) <= 90) & (np.abs(longitude) <= 360)
    there &= (latitude != 0) | (longitude != 0)
    return there


Placing = Callable[[Quantities], Floats]


def _placing(origin: Origin) -> Placing:
    frame = local_frame(origin.latitude_deg, origin.longitude_deg, origin.altitude_m)

    def place(quantities: Quantities) -> Floats:
        """Return (n, 3) east, north, up; NaN where there is no position."""
        if quantities.require(_GEODETIC, _LOCAL) == _LOCAL:
            up_m = np.nan_to_num(quantities.get("up_m"))
            return np.column_stack([quantities.get("east_m"), quantities.get("north_m"), up_m])
        latitude, longitude = (quantities.get(name) for name in _GEODETIC)
        altitude = quantities.get("altitude_m")
        altitude = np.where(np.isfinite(altitude), altitude, origin.altitude_m)
        found = np.full((len(latitude), 3), np.nan)
        for i in np.flatnonzero(_on_earth(latitude, longitude)):
            found[i] = to_local(frame, latitude[i], longitude[i], altitude[i])
        found[np.abs(found).max(axis=1) > _MOST_FRAME_M] = np.nan
        return found

    return place


def _fixes(source: FixSource, content: LogContent, place: Placing, remarks: list[str]) -> FixSeries:
    quantities = Quantities("fixes", source, content)
    place_m = place(quantities)
    fix = np.nan_to_num(quantities.get("fix"), nan=SINGLE).astype(np.int64).clip(NONE, FIXED)
    if not quantities.known("fix") and source.taken_as is None:
        remarks.append(
            "fixes: their kind is not in the log, and they are taken as single ones; if they are RTK-fixed, say "
            '"taken_as": "fixed" in the mapping, or name a column with the kinds as "fix"'
        )
    there = np.isfinite(place_m).all(axis=1)
    fix[~there] = NONE
    if source.taken_as is not None:
        fix[fix != NONE] = FIX_KINDS.index(source.taken_as)
    sigma_m = _sigma(quantities, source)
    unknown = ~np.isfinite(sigma_m) | (sigma_m <= 0)
    if (unknown & (fix != NONE)).any():
        count = int((unknown & (fix != NONE)).sum())
        remarks.append(
            f"fixes: {count:,} report no σ; by their kind it is taken as {_words(fix[unknown & (fix != NONE)])}; "
            'give "sigma_m" if it is another'
        )
    sigma_m = np.where(unknown, [UNKNOWN_SIGMA_M[int(each)] for each in fix], sigma_m)
    kept, problems = in_order(quantities.time_s)
    remarks += [f"fixes: {problem}" for problem in problems]
    if quantities.table.kind == "csv":
        own = changes(quantities.time_s[kept], np.nan_to_num(np.column_stack([place_m, sigma_m, fix])[kept]))
        if not own.all():
            remarks.append(
                f"fixes: {int((~own).sum()):,} of {len(kept):,} rows repeat the one before, and are left out"
            )
        kept = kept[own]
    lost = int((fix[kept] == NONE).sum())
    if lost:
        remarks.append(f"fixes: {lost:,} of {len(kept):,} have no position")
    if lost == len(kept):
        raise LogError(
            f"{source.stream}: none of its {len(quantities.time_s):,} messages has a position and a time"
            f"{_beyond(quantities)}"
        )
    return FixSeries(
        quantities.time_s[kept],
        np.where(np.isfinite(place_m[kept]), place_m[kept], 0.0),
        sigma_m[kept].clip(0.0, 1e4),
        fix[kept],
        np.nan_to_num(quantities.get("satellites")[kept]).astype(np.int64).clip(0, 255),
        np.nan_to_num(quantities.get("age_s")[kept], posinf=0.0, neginf=0.0).clip(0.0, 1e6),
    )


def _beyond(quantities: Quantities) -> str:
    """Return, as an aside, which geodetic columns read what no place on earth has."""
    most = {name: float(np.nanmax(np.abs(quantities.get(name)), initial=0.0)) for name in _GEODETIC}
    beyond = " and ".join(
        f"fixes.columns.{name} up to {most[name]:,.0f}" for name in _GEODETIC if most[name] > _MOST_DEG[name]
    )
    return f"; it reads {beyond}: give scales that make them degrees, or exchange the two columns" if beyond else ""


def _sigma(quantities: Quantities, source: FixSource) -> Floats:
    """Return (n,) the larger σ of both axes."""
    if source.sigma_m is not None:
        return np.full(len(quantities.time_s), source.sigma_m)
    if quantities.known("sigma_m"):
        return quantities.get("sigma_m")
    return np.fmax(quantities.get("sigma_east_m"), quantities.get("sigma_north_m"))


def _words(fix: NDArray[np.int64]) -> str:
    return ", ".join(f"{UNKNOWN_SIGMA_M[int(each)]:g} m ({FIX_KINDS[int(each)]})" for each in np.unique(fix))


def _ordered(
    part: str,
    quantities: Quantities,
    values: Floats,
    remarks: list[str],
    needed: int | None = None,
    *,
    steps: bool = False,
) -> tuple[Floats, Floats]:
    """Return stamps and values in order, without those of which the first `needed` (all) are not finite.

    Values that a table holds for several rows are interpolated, unless they are `steps`, which add up.
    """
    if quantities.table.kind == "csv" and not steps:
        values = np.column_stack([between_changes(quantities.time_s, column) for column in values.T])
    finite = np.asarray(np.isfinite(values[:, :needed]).all(axis=1))
    if not finite.all():
        remarks.append(f"{part}: {int((~finite).sum()):,} of {len(finite):,} readings are no numbers, and are left out")
    kept, problems = in_order(np.where(finite, quantities.time_s, np.nan)[finite])
    remarks += [f"{part}: {problem}" for problem in problems]
    if not len(kept):
        raise LogError(f"{quantities.table.stream}: has no reading with numbers and a time")
    return quantities.time_s[finite][kept], values[finite][kept]


def _take_imu(source: ImuSource, content: LogContent, found: ForeignSensors) -> None:
    quantities = Quantities("imu", source, content)
    rates = tuple(f"gyro_{axis}_radps" for axis in "xyz")
    force = tuple(f"accel_{axis}_mps2" for axis in "xyz")
    chosen = quantities.require(rates, ("turn_rad",), ("yaw_rate_radps",), ("yaw_rad",))
    found.columns["imu"] = chosen
    values = np.column_stack([quantities.get(name) for name in chosen])
    if chosen == ("yaw_rad",):
        values = _unwrapped(values)
    time_s, values = _ordered("imu", quantities, values, found.remarks, steps=chosen == ("turn_rad",))
    if chosen == ("yaw_rad",):
        found.turn = RateSeries(time_s, values, cumulative=True)
    elif chosen == rates:
        found.rates = RateSeries(time_s, values @ _turned(source).T)
    elif chosen == ("turn_rad",):
        found.turn = RateSeries(time_s, np.cumsum(values, axis=0), cumulative=True)
    else:
        found.turn = RateSeries(time_s, values)
    if source.accelerometer and quantities.known(*force):
        values = np.column_stack([quantities.get(name) for name in force])
        time_s, values = _ordered("imu", quantities, values, found.remarks)
        found.force = RateSeries(time_s, values @ _turned(source).T)


def _unwrapped(angles: Floats) -> Floats:
    """Return angles [rad] that go on beyond half a turn; NaN where there is none.

    Those beyond a turn go on already, or are in another unit.
    """
    there = np.isfinite(angles)
    if there.any() and np.ptp(angles[there]) <= _TURN_RAD:
        angles[there] = np.unwrap(angles[there])
    return angles


def _turned(source: ImuSource) -> Floats:
    """Return the (3, 3) rotation from the sensor's axes to the body's."""
    rotation = np.zeros((3, 3))
    for i, axis in enumerate(source.axes):
        rotation[i, "xyz".index(axis[-1])] = -1.0 if axis.startswith("-") else 1.0
    return rotation


def _take_wheels(source: WheelSource, content: LogContent, found: ForeignSensors) -> None:
    quantities = Quantities("wheels", source, content)
    choices = ("left_rad", "right_rad"), ("distance_m", "turn_rad"), ("speed_mps", "yaw_rate_radps")
    alone = ("speed_mps",) if found.turn is not None or found.rates is not None else ()
    chosen = quantities.require(*choices, *([alone] if alone else []))
    found.columns["wheels"] = chosen
    values = np.column_stack([quantities.get(name) for name in chosen])
    time_s, values = _ordered("wheels", quantities, values, found.remarks, steps=chosen == choices[1])
    if chosen == alone:
        values = np.column_stack([values, _yaw_rate(found, time_s)])
        found.remarks.append("wheels: they have no yaw rate, and are taken to turn as the IMU does")
    if chosen == choices[0]:
        found.joints = RateSeries(time_s, values, cumulative=True)
        return
    step_s = np.diff(time_s, prepend=np.nan) if chosen == choices[1] else np.ones(len(time_s))
    fastest = np.maximum(np.abs(values[:, 0]), _LEVER_M * np.abs(values[:, 1]))
    moved = ~(fastest < source.standing_mps * step_s)
    values = np.where(moved[:, None], values, 0.0)
    if chosen == choices[1]:
        found.travel = RateSeries(time_s, np.cumsum(values, axis=0), cumulative=True)
    else:
        found.travel = RateSeries(time_s, values)


def _yaw_rate(found: ForeignSensors, at_s: Floats) -> Floats:
    """Return the yaw rate by the IMU [rad/s]."""
    if found.rates is not None:
        return np.interp(at_s, found.rates.time_s, found.rates.values[:, 2])
    assert found.turn is not None
    if not found.turn.cumulative:
        return np.interp(at_s, found.turn.time_s, found.turn.values[:, 0])
    turned = np.interp(at_s, found.turn.time_s, found.turn.values[:, 0])
    return np.gradient(turned, at_s) if len(at_s) > 1 else np.zeros(1)


def _track(source: TrackSource, content: LogContent, place: Placing, remarks: list[str]) -> TrackSeries:
    quantities = Quantities("reference", source, content)
    place_m = place(quantities)
    heading = quantities.get("heading_rad")
    time_s, values = _ordered("reference", quantities, np.column_stack([place_m, heading]), remarks, needed=3)
    headings, there = values[:, 3], np.isfinite(values[:, 3])
    if there.any():
        headings = np.interp(time_s, time_s[there], _unwrapped(headings[there]))
    return TrackSeries(time_s, values[:, :3], headings, source.point == "antenna")
