"""State in which a robot is given a job: a check of a recording can begin there, whatever came before.

A robot that has driven before differs from one that was just switched on: errors of its receiver, biases, wheel angles,
tank and battery persist. All of that is in records, which are kept field by field, and the last hits of its lidars in
arrays; what today's code derives from the setup, such as noise figures and limits, is left out. A job's own state is
made with the job, so it is not included.
"""

from __future__ import annotations

import base64
import json
import math
import zlib
from collections.abc import Iterator, Mapping
from typing import Any, Final, NamedTuple, Self, cast

import numpy as np
from numpy.typing import NDArray

from touchline.onboard import Onboard
from touchline.onboard.computer_state import FLOW_WINDOW_TICKS, ComputerState
from touchline.onboard.estimation.blind_run import LONGEST_TICKS
from touchline.onboard.estimation.filter import Estimator, Gathered
from touchline.onboard.interface import ANGLES, Command
from touchline.schemas.errors import SpecError
from touchline.services.robot_sim.fault_timeline import FaultTimeline, TimedFault
from touchline.services.robot_sim.sensors.auxiliary_truth import AuxiliaryTruth, UnderWay
from touchline.services.robot_sim.sensors.gnss_truth import FIXED
from touchline.services.robot_sim.sensors.suite import Sensors
from touchline.services.robot_sim.sensors.transport import HISTORY, PENDING
from touchline.services.robot_sim.world.world import World

Arrays = dict[str, NDArray[Any]]

COMPUTER: Final = "computer"
_TRANSPORT: Final = "transport"
_PROTECTION: Final = "protection"
_HITS: Final = f"{_PROTECTION}.hits."
"""Begin of the paths of `Protector.kept_hits`, whose number and lengths differ from state to state."""
_SAMPLED: Final = "fast"  # the 100 Hz sensors are one record in recordings
_MADE_OF_SETUP: Final = frozenset(
    (
        *(
            f"{COMPUTER}.safety.{name}"
            for name in (
                "fence_timeout_s",
                "lag_share",
                "max_step",
                "tolerance",
                "tolerance_share",
                "nominal_l",
                "settle_ticks",
                "fence_margin_m",
                "body_radius_m",
            )
        ),
        *(f"{COMPUTER}.pose.{name}" for name in ("needs_fixes", "fix_age_s", "sigma_m", "blind_sigma_m")),
    )
)
"""Fields derived from the setup, in addition to all records that are called `figures`; the next are reset by a job."""
_MADE_OF_JOB: Final = (f"{COMPUTER}.leg.", f"{COMPUTER}.guidance.", f"{COMPUTER}.way.")
_MOST: Final[Mapping[str, float]] = {
    f"{_TRANSPORT}.pending_count": PENDING,
    f"{COMPUTER}.safety.flow_first": FLOW_WINDOW_TICKS - 1,
    f"{COMPUTER}.safety.flow_count": FLOW_WINDOW_TICKS,
    f"{COMPUTER}.filter.blind.span_ticks": LONGEST_TICKS,
    "receiver.fix": FIXED,
}
"""Largest values of fields that kernels use as an index, and of a length in ticks, which may exceed the tick."""
_MOST_COUNT: Final = 1 << 40
_MOST_BYTES: Final = 4_000_000
_MOST_FIELDS: Final = 1000


class DamagedState(SpecError):
    """A recorded state that is invalid, or not of such a robot.

    Args:
        field: Wrong field of the state; empty for all of it.
        problem: The problem, as a predicate.
    """

    def __init__(self, field: str, problem: str) -> None:
        remedy = "check a recording that has another, or record the session anew"
        super().__init__("the robot's state at the job's begin", field, problem, remedy)


class RobotParts(NamedTuple):
    """Parts of a robot whose state persists from job to job."""

    world: World
    sensors: Sensors
    auxiliary: AuxiliaryTruth
    faults: FaultTimeline
    onboard: Onboard

    def fields(self) -> Arrays:
        """Return the fields of all records that are kept, by their paths: views, to be read and set."""
        world, sensing = self.world, self.sensors.sensing
        records: list[tuple[str, Any]] = [
            ("body", world.state.array),
            ("drive", world.drive.array),
            *((_SAMPLED, record) for record in (sensing.imu, sensing.magnetometer, sensing.encoders)),
            ("receiver", sensing.gnss),
            ("camera", sensing.camera),
            (_TRANSPORT, sensing.transport),
            (COMPUTER, self.onboard.computer),
        ]
        if self.onboard.protection.on:
            records.append((_PROTECTION, self.onboard.protection.memory.array))
        found = {path: field for name, array in records for path, field in _leaves(name, array)}
        return {path: field for path, field in found.items() if not _is_made(path)} | world.own_arrays


def _leaves(path: str, array: NDArray[np.void]) -> Iterator[tuple[str, NDArray[Any]]]:
    """Yield the fields of a structured array that are arrays of numbers, records in records field by field."""
    for name in array.dtype.names or ():
        field = array[name]
        if field.dtype.names:
            yield from _leaves(f"{path}.{name}", field)
        else:
            yield f"{path}.{name}", field


def _is_made(path: str) -> bool:
    """Return True if a field is derived from the setup or made by a job, and not kept."""
    return ".figures." in path or path in _MADE_OF_SETUP or path.startswith(_MADE_OF_JOB)


class InitialState(NamedTuple):
    """State of a robot at the end of a tick.

    Attributes:
        tick: Tick in which the job was given.
        orders: Number of orders that the robot had carried out since it was switched on.
        command: Command in force.
        faults: Faults that act, or are still to come.
        gathered: Samples gathered by an estimator that has not started; None if it has started.
        fields: Fields of the records, by path; see `RobotParts.fields`.
        under_way: Samples of auxiliary sensors in transit to the computer.
    """

    tick: int
    orders: int
    command: Command
    faults: tuple[TimedFault, ...]
    gathered: Gathered | None
    fields: Arrays
    under_way: tuple[UnderWay, ...] = ()

    @classmethod
    def of(cls, parts: RobotParts, tick: int, orders: int, command: Command) -> Self:
        """Copy the state of a robot at the end of a tick.

        Args:
            parts: Parts of the robot.
            tick: The tick.
            orders: Number of orders so far.
            command: Command in force.
        """
        fields = {path: field.copy() for path, field in parts.fields().items()}
        if parts.onboard.protection.on:
            fields |= {f"{_HITS}{name}": field for name, field in parts.onboard.protection.kept_hits.items()}
        gathered = parts.onboard.estimator.gathered
        return cls(tick, orders, command, parts.faults.timed, gathered, fields, parts.auxiliary.under_way)

    def restore(self, parts: RobotParts) -> None:
        """Bring a robot that has just been switched on into this state.

        Raises:
            DamagedState: It is not the state of such a robot.
        """
        self.check_actuators(len(parts.world.state.angles_rad))
        self._set(parts.fields())
        self._restore_hits(parts.onboard)
        parts.faults.restore(self.faults, self.tick)
        parts.auxiliary.restore(self.under_way, self.tick)
        parts.onboard.estimator.gathered = self.gathered

    def _restore_hits(self, onboard: Onboard) -> None:
        hits = {path.removeprefix(_HITS): field for path, field in self.fields.items() if path.startswith(_HITS)}
        if not hits or not onboard.protection.on:
            return
        try:
            onboard.protection.restore_hits(hits)
        except (ValueError, KeyError, OverflowError) as error:
            raise DamagedState(_HITS.rstrip("."), f"cannot be used: {error}") from error

    def restore_estimator(self, estimator: Estimator, computer: ComputerState) -> None:
        """Bring an estimator and its computer into this state.

        Args:
            estimator: The estimator.
            computer: State of the computer that it is a part of.

        Raises:
            DamagedState: It is not the state of such a robot.
        """
        leaves = _leaves(COMPUTER, cast("NDArray[np.void]", computer.array))
        self._set({path: field for path, field in leaves if not _is_made(path)})
        estimator.gathered = self.gathered

    def _set(self, fields: Arrays) -> None:
        for path, field in fields.items():
            kept = self.fields.get(path)
            if kept is None:
                continue  # a field that is newer than the recording stays as at switch-on
            if kept.dtype != field.dtype or kept.shape != field.shape:
                now, then = (f"{each.dtype} of shape {each.shape[1:]}" for each in (field, kept))
                raise DamagedState(path, f"is {then}, for such a robot {now} today")
            field[...] = kept

    def check_actuators(self, count: int) -> None:
        """Check that the state is of a robot whose drive has so many actuators.

        Raises:
            DamagedState: It is not.
        """
        numbers = {"command": len(self.command.actuators)}
        if (readings := self.fields.get(f"{_TRANSPORT}.readings")) is not None:
            numbers[f"{_TRANSPORT}.readings"] = readings.shape[-1] - ANGLES
        for field, number in numbers.items():
            if number != count:
                raise DamagedState(field, f"has {number} actuators, the vehicle's drive has {count}")

    @property
    def arrived(self) -> tuple[NDArray[Any], NDArray[Any]]:
        """Readings (READINGS,) of the 100 Hz sensors at the computer, and their ticks of measurement (3,)."""
        return self.fields[f"{_TRANSPORT}.readings"][0], self.fields[f"{_TRANSPORT}.measured_tick"][0]

    @property
    def text(self) -> str:
        """The state as JSON, with all bits."""
        fields = {path: _worn(path, field, self) for path, field in self.fields.items()}
        layout = [(path, field.dtype.str, field.shape) for path, field in fields.items()]
        data = b"".join(field.tobytes() for field in fields.values())
        actuators, *rest = self.command
        return json.dumps(
            {
                "tick": self.tick,
                "orders": self.orders,
                "command": [list(actuators), *rest],
                "faults": [each.as_json() for each in self.faults],
                "gathered": self.gathered,
                "under_way": [each.as_json() for each in self.under_way],
                "fields": layout,
                "fields_zlib": base64.b64encode(zlib.compress(data, 1)).decode(),
            },
            separators=(",", ":"),
        )

    @classmethod
    def from_text(cls, text: str) -> Self:
        """Read a state from its text.

        Raises:
            DamagedState: It is not valid.
        """
        try:
            content = json.loads(text)
            actuators, valve, disc, valve_after_s = content["command"]
            gathered = content["gathered"]
            found = cls(
                int(content["tick"]),
                int(content["orders"]),
                Command(tuple(map(float, actuators)), bool(valve), bool(disc), float(valve_after_s)),
                tuple(map(TimedFault.from_json, content["faults"])),
                None if gathered is None else Gathered.from_json(gathered),
                _unpacked(content["fields"], content["fields_zlib"]),
                tuple(map(UnderWay.from_json, content.get("under_way", ()))),
            )
            found._check()
        except (ValueError, KeyError, TypeError, OverflowError, RecursionError, zlib.error, SpecError) as error:
            raise DamagedState("", f"cannot be read: {error}") from error
        return found

    def _check(self) -> None:
        """Refuse values that would break kernels, which do not check bounds.

        Raises:
            ValueError: A field is impossible.
        """
        if not 0 <= self.tick <= _MOST_COUNT:
            raise ValueError("tick is impossible")
        for path, field in self.fields.items():
            whole = field.dtype.kind == "i"
            most: float = self.tick + 1 if "tick" in path or path == f"{_TRANSPORT}.schedule" else _MOST_COUNT
            most = _MOST.get(path, most if whole else math.inf)
            least = 0 if path in _MOST else -1 if whole else -math.inf
            numbers = field.astype(np.float64) if whole or path in _MOST else field
            if (whole or path in _MOST) and not ((numbers >= least) & (numbers <= most)).all():
                raise ValueError(f"{path} is impossible")
            if path.startswith(("body.", "drive.", "movers", "trail")) and not np.isfinite(numbers).all():
                raise ValueError(f"{path} is not finite")


def _worn(path: str, field: NDArray[Any], state: InitialState) -> NDArray[Any]:
    """Clear the samples of a field that will not be read again: they are noise, which cannot be compressed."""
    schedule = state.fields.get(f"{_TRANSPORT}.schedule")
    if path != f"{_TRANSPORT}.history" or schedule is None:
        return field
    due = schedule[schedule >= 0]
    asked = np.unique(np.concatenate((due, due - 1, [state.tick])) % HISTORY)
    worn = np.zeros_like(field)
    worn[:, asked] = field[:, asked]
    return worn


def _unpacked(layout: list[Any], packed: str) -> Arrays:
    """Unpack the fields by their paths.

    Raises:
        ValueError, TypeError, zlib.error: They are not valid.
    """
    if len(layout) > _MOST_FIELDS:
        raise ValueError("there are too many fields")
    unpacker = zlib.decompressobj()
    data = unpacker.decompress(base64.b64decode(packed, validate=True), _MOST_BYTES)
    fields, at = Arrays(), 0
    for path, kind, shape in layout:
        if kind not in ("<f8", "<i8", "|b1") or not all(type(each) is int and each >= 0 for each in shape):
            raise ValueError(f"{path} is of no known kind")
        size = np.dtype(kind).itemsize * math.prod(shape)
        if at + size > len(data):
            raise ValueError(f"{path} is not there in full")
        fields[str(path)] = np.frombuffer(data[at : at + size], kind).reshape(shape)
        at += size
    return fields
