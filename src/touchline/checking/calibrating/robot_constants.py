"""Constants that a drive can tell: where each stands in the robot's files, and how far from there it may be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce
from typing import Any, Final, NamedTuple, TypeVar, cast

from touchline.schemas.setup import Setup
from touchline.schemas.spec import Spec

_S = TypeVar("_S", bound=Spec)


class Constant(NamedTuple):
    """A constant of the robot.

    Attributes:
        name: Name for people.
        path: Fields that lead to it in the setup.
        unit: Its unit, and that of all following.
        start_sigma: Standard deviation of what the files say, before a drive.
        floor: Smallest standard deviation that is claimed: slip that the filter does not model looks like this much.
        most: Largest change that is believed.
        step: Difference for derivatives: small enough to be linear, large enough for the arithmetic.
        needs: Facts of the motion without which it cannot be told, by their names in `drive_motion.DriveMotion`.
    """

    name: str
    path: tuple[str, ...]
    unit: str
    start_sigma: float
    floor: float
    most: float
    step: float
    needs: tuple[str, ...]

    def of(self, setup: Setup) -> float:
        """Return its value in a robot's files."""
        value: Any = reduce(getattr, self.path, cast("Any", setup))
        return float(value)

    def in_file(self) -> str:
        """Return where it stands, for people."""
        return f"{self.path[0]} {'.'.join(self.path[1:])}"


GYRO_SCALE: Final = Constant(
    "gyro scale", ("onboard", "imu", "gyro_scale_relative"), "", 0.01, 2e-4, 0.05, 2e-5, ("turns_both_ways",)
)
ANTENNA_X: Final = Constant(
    "antenna forward", ("vehicle", "body", "gnss_antenna_x_m"), "m", 0.02, 0.002, 0.1, 1e-4, ("turns_about",)
)
ANTENNA_Y: Final = Constant(
    "antenna left", ("vehicle", "body", "gnss_antenna_y_m"), "m", 0.02, 0.002, 0.1, 1e-4, ("turns_about",)
)
STAMP_OFFSET: Final = Constant(
    "stamp offset", ("onboard", "gnss", "stamp_offset_s"), "s", 0.02, 0.002, 0.2, 1e-4, ("changes_speed",)
)
TRACK: Final = Constant(
    "track width", ("vehicle", "drive", "track_width_m"), "m", 0.005, 0.001, 0.05, 5e-5, ("turns_both_ways",)
)
SIDE_SLIP: Final = Constant(
    "side slip", ("vehicle", "drive", "side_slip_rad_per_mps2"), "rad s²/m", 0.005, 0.001, 0.05, 1e-5,
    ("changes_speed", "turns_both_ways"),
)  # fmt: skip
CONSTANTS: Final = (GYRO_SCALE, ANTENNA_X, ANTENNA_Y, STAMP_OFFSET, TRACK, SIDE_SLIP)


def constants_of(setup: Setup) -> tuple[Constant, ...]:
    """Return the constants that this kind of robot has."""
    return tuple(constant for constant in CONSTANTS if _has(setup, constant.path))


def changed(setup: Setup, changes: Mapping[Constant, float]) -> Setup:
    """Return a setup in which constants have been changed by so much."""
    for constant, change in changes.items():
        setup = _put(setup, constant.path, constant.of(setup) + change)
    return setup


def _has(spec: Any, path: Sequence[str]) -> bool:
    return not path or (hasattr(spec, path[0]) and _has(getattr(spec, path[0]), path[1:]))


def _put(spec: _S, path: Sequence[str], value: float) -> _S:
    name, *rest = path
    return spec.model_copy(update={name: _put(getattr(spec, name), rest, value) if rest else value})
