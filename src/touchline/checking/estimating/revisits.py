"""Revisits: whether a receiver errs alike each time the robot comes to a place, as reflections make it.

On one pass nothing tells a bent map from a bent path. So the filter is run with fixes whose error may move within
seconds, and what it then leaves of them is compared over pairs of passes that are far apart in time. A robot that
wanders, or a receiver that does, errs anew on each pass.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.checking.estimating.estimator_inputs import EstimatorInputs
from touchline.checking.estimating.estimator_run import EstimatorRun, rerun
from touchline.onboard.interface import TICKS_PER_S
from touchline.schemas.setup import Setup

Floats = NDArray[np.float64]

APART_S: Final = 30.0
"""Least time between two passes."""
NEAR_M: Final = 1.0
"""Largest distance between them."""
LEAST_PAIRS: Final = 300
"""Fewest pairs, of places a second apart, that tell something."""
BENT_FROM: Final = 0.25
"""Correlation from which fixes are bent by the place."""
_ERROR: Final = {"gauss_markov_1_m": 0.012, "gauss_markov_1_tau_s": 6.0, "gauss_markov_2_m": 0.0}
_CERTAIN: Final = {"antenna_sigma_m": 0.0, "stamp_offset_sigma_s": 0.0}  # or such a filter would change them at ease
_CELL_M: Final = 3.0
_MOVED_M: Final = 0.1
"""Least distance from the row before, a second earlier, of a robot that passes."""
_SETTLING_S: Final = 10.0  # after the start, until the heading is known


class Revisits(NamedTuple):
    """Comparison of passes over the same places.

    Attributes:
        pairs: Number of pairs that have been compared.
        correlation: Correlation of the fixes' errors over them; 0 if there are none.
        place_m: East and north of the place where the fixes are bent most.
        bend_m: By how far there, root mean square over the passes.
    """

    pairs: int
    correlation: float
    place_m: tuple[float, float]
    bend_m: float

    @property
    def told(self) -> bool:
        """True if there are enough pairs to tell."""
        return self.pairs >= LEAST_PAIRS

    @property
    def bent(self) -> bool:
        """True if the fixes are bent by the place."""
        return self.told and self.correlation > BENT_FROM

    def as_json(self) -> dict[str, Any]:
        """Return the figures as a JSON object; what too few pairs do not tell is None."""
        return {
            "pairs": self.pairs,
            "correlation": self.correlation if self.told else None,
            "bent_at_m": list(self.place_m) if self.bent else None,
            "bend_m": self.bend_m if self.bent else None,
        }

    @property
    def words(self) -> str:
        """Sentence about bent fixes; empty if they are not."""
        if not self.bent:
            return ""
        east_m, north_m = self.place_m
        return (
            f"the fixes are bent at this place: by {1e3 * self.bend_m:.0f} mm around {east_m:z.0f} m east, "
            f"{north_m:z.0f} m north, alike on passes more than {APART_S:.0f} s apart (correlated by "
            f"{self.correlation:.2f}); something there reflects the signals"
        )


def revisits(inputs: EstimatorInputs, setup: Setup) -> Revisits:
    """Compare the fixes of a recording over passes.

    Args:
        inputs: The recording.
        setup: Setup of the robot.
    """
    sheet = setup.onboard.gnss.model_copy(update=_ERROR | _CERTAIN)
    imu = setup.onboard.imu.model_copy(update={"gyro_scale_sigma": 0.0})
    moving = setup.model_copy(update={"onboard": setup.onboard.model_copy(update={"gnss": sheet, "imu": imu})})
    return compared(*_left(rerun(inputs, moving, inputs.frames, forgiving=True)))


def compared(time_s: Floats, places_m: Floats, errors_m: Floats) -> Revisits:
    """Compare errors of fixes at places that are near each other; a robot that rests passes nothing meanwhile.

    Args:
        time_s: (n,) times, about a second apart.
        places_m: (n, 2) places then, east and north.
        errors_m: (n, 2) errors then, east and north.
    """
    moved = np.hypot(*np.diff(places_m, axis=0, prepend=places_m[:1]).T) > _MOVED_M
    time_s, places_m, errors_m = time_s[moved], places_m[moved], errors_m[moved]
    off_m = errors_m - errors_m.mean(axis=0) if len(errors_m) else errors_m
    near = np.hypot(*np.moveaxis(places_m[:, None] - places_m, -1, 0)) < NEAR_M
    one, other = np.nonzero(near & (time_s[:, None] - time_s > APART_S))
    if not len(one):
        return Revisits(0, 0.0, (0.0, 0.0), 0.0)
    product = (off_m[one] * off_m[other]).sum(axis=1)
    power = float(np.sqrt((off_m[one] ** 2).sum() * (off_m[other] ** 2).sum()))
    cells = np.round(places_m[one] / _CELL_M)
    found, member, count = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    # A place counts by all its pairs: one that two passes happen to agree about is not the one that is bent most.
    shared = np.bincount(member.ravel(), product) / np.maximum(count, np.median(count))
    worst = int(np.argmax(shared))
    east_m, north_m = (_CELL_M * found[worst]).tolist()
    return Revisits(
        len(one), float(product.sum()) / max(power, 1e-12), (east_m, north_m), float(np.sqrt(max(shared[worst], 0.0)))
    )


def _left(run: EstimatorRun) -> tuple[Floats, Floats, Floats]:
    """Return times, places, and what the estimate leaves of the fixes, means of each second.

    What goes with the body is subtracted: an arm or a delay that is wrong bends no place.
    """
    measured_s = run.fixes[:, 0] + run.setup.onboard.gnss.stamp_offset_s
    tick = np.clip(np.round(measured_s * TICKS_PER_S).astype(np.int64), 0, len(run.poses) - 1)
    pose = run.poses[tick]
    settled = np.isfinite(pose).all(axis=1)
    settled &= measured_s > (run.starts_s[-1] if run.starts_s else np.inf) + _SETTLING_S
    body = _turned(run.fixes[settled, 1:3] - pose[settled, :2], -pose[settled, 2])
    off_m = _turned(body - body.mean(axis=0), pose[settled, 2]) if settled.any() else body
    rows = np.column_stack((measured_s[settled], pose[settled, :2], off_m))
    seconds, member, count = np.unique(np.floor(rows[:, 0]), return_inverse=True, return_counts=True)
    means = np.column_stack([np.bincount(member, column) / count for column in rows.T]).reshape(len(seconds), 5)
    return means[:, 0], means[:, 1:3], means[:, 3:]


def _turned(vectors: Floats, by_rad: Floats) -> Floats:
    """Return (n, 2) vectors turned to the left by (n,) angles."""
    cos, sin = np.cos(by_rad), np.sin(by_rad)
    return np.column_stack((cos * vectors[:, 0] - sin * vectors[:, 1], sin * vectors[:, 0] + cos * vectors[:, 1]))
