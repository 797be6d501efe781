"""Constants that a drive can tell: where each stands in the robot's files, and how far from there it may be."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import reduce
from typing import Any, Final, NamedTuple, TypeVar, cast

from touchline.onboard.estimation.learned_constants import FLOORS, NAMES
from touchline.schemas.onboard import Calibrated
from touchline.schemas.setup import Setup
from touchline.schemas.spec import Spec

_S = TypeVar("_S", bound=Spec)


class Constant(NamedTuple):
    """A constant of the robot.

    Attributes:
        name: Name for people.
        path: Fields that lead to it in the setup.
        sigma_path: Fields that lead to its standard deviation in the setup; empty if the estimator does not learn it.
        record: Field of its calibration in `onboard.calibrated`.
        unit: Its unit, and that of all following.
        start_sigma: Standard deviation of what the files say, before a drive.
        floor: Smallest standard deviation that is claimed: slip that the filter does not model looks like this much.
        most: Largest change that is believed.
        step: Difference for derivatives: small enough to be linear, large enough for the arithmetic and for the jump
            of innovations where a fix passes from one tick to the next.
        needs: Facts of the motion without which it cannot be told, by their names in `drive_motion.DriveMotion`.
    """

    name: str
    path: tuple[str, ...]
    sigma_path: tuple[str, ...]
    record: str
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
    name=NAMES[0],
    path=("onboard", "imu", "gyro_scale_relative"),
    sigma_path=("onboard", "imu", "gyro_scale_sigma"),
    record="gyro_scale",
    unit="",
    start_sigma=0.01,
    floor=FLOORS[0],
    most=0.05,
    step=2e-5,
    needs=("turns_both_ways",),
)
ANTENNA_X: Final = Constant(
    name=NAMES[1],
    path=("vehicle", "body", "gnss_antenna_x_m"),
    sigma_path=("onboard", "gnss", "antenna_sigma_m"),
    record="antenna",
    unit="m",
    start_sigma=0.02,
    floor=FLOORS[1],
    most=0.1,
    step=1e-4,
    needs=("turns_about",),
)
ANTENNA_Y: Final = ANTENNA_X._replace(name=NAMES[2], path=("vehicle", "body", "gnss_antenna_y_m"), floor=FLOORS[2])
STAMP_OFFSET: Final = Constant(
    name=NAMES[3],
    path=("onboard", "gnss", "stamp_offset_s"),
    sigma_path=("onboard", "gnss", "stamp_offset_sigma_s"),
    record="stamp_offset",
    unit="s",
    start_sigma=0.02,
    floor=FLOORS[3],
    most=0.2,
    step=2e-3,
    needs=("changes_speed",),
)
TRACK: Final = Constant(
    name="track width",
    path=("vehicle", "drive", "track_width_m"),
    sigma_path=(),
    record="track_width",
    unit="m",
    start_sigma=0.005,
    floor=0.001,
    most=0.05,
    step=5e-5,
    needs=("turns_both_ways",),
)
SIDE_SLIP: Final = Constant(
    name="side slip",
    path=("vehicle", "drive", "side_slip_rad_per_mps2"),
    sigma_path=(),
    record="side_slip",
    unit="rad s²/m",
    start_sigma=0.005,
    floor=0.001,
    most=0.05,
    step=1e-5,
    needs=("changes_speed", "turns_both_ways"),
)
CONSTANTS: Final = (GYRO_SCALE, ANTENNA_X, ANTENNA_Y, STAMP_OFFSET, TRACK, SIDE_SLIP)


def constants_of(setup: Setup) -> tuple[Constant, ...]:
    """Return the constants that this kind of robot has."""
    return tuple(constant for constant in CONSTANTS if _has(setup, constant.path))


def changed(setup: Setup, changes: Mapping[Constant, float]) -> Setup:
    """Return a setup in which constants have been changed by so much."""
    for constant, change in changes.items():
        setup = _put(setup, constant.path, constant.of(setup) + change)
    return setup


def with_sigmas(setup: Setup, sigmas: Mapping[Constant, float]) -> Setup:
    """Return a setup that says how well constants are known; a field of two has the larger σ."""
    largest: dict[tuple[str, ...], float] = {}
    for constant, sigma in sigmas.items():
        if constant.sigma_path:
            largest[constant.sigma_path] = max(sigma, largest.get(constant.sigma_path, 0.0))
    for path, sigma in largest.items():
        setup = _put(setup, path, sigma)
    return setup


def recorded(setup: Setup, constants: Iterable[Constant], by: Calibrated) -> Setup:
    """Return a setup that says by which calibration constants are known."""
    for constant in constants:
        setup = _put(setup, ("onboard", "calibrated", constant.record), by)
    return setup


def _has(spec: Any, path: Sequence[str]) -> bool:
    return not path or (hasattr(spec, path[0]) and _has(getattr(spec, path[0]), path[1:]))


def _put(spec: _S, path: Sequence[str], value: float | Calibrated) -> _S:
    name, *rest = path
    return spec.model_copy(update={name: _put(getattr(spec, name), rest, value) if rest else value})
