"""Figures of an estimator run: consistency, rejected fixes, and errors."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from touchline.checking.estimating.estimator_run import EstimatorRun
from touchline.checking.estimating.innovation_tests import fixes_whiteness
from touchline.checking.estimating.reference_frame import FrameFit, aligned
from touchline.core.angles import wrapped_all
from touchline.onboard.estimation.consistency_monitor import compared_innovations
from touchline.onboard.estimation.filter import AcceptedJump
from touchline.onboard.estimation.tail import OUTLYING
from touchline.onboard.filter_model import FIX_DOF
from touchline.recordings.logs.misfits import does_not_fit
from touchline.recordings.logs.reversals import UNSIGNED, against_the_wheels
from touchline.schemas.vehicles import ODOMETRY

Floats = NDArray[np.float64]

LEAST_ACCEPTED_PCT: Final = 90.0
"""Least share of accepted fixes within the estimator's assumptions."""
SIGMA_FACTOR: Final = 10.0
"""Fixes that report this multiple of the data sheet's σ come from another kind of receiver."""
MOST_WHEEL_NIS: Final = 2.5
"""Largest mean NIS of the wheels' readings, of which 2 is expected, within the estimator's assumptions."""
_THREE_SIGMA: Final = 9.0
_UNIT_NAMES: Final = {"%": "pct", "mm": "mm", "ms": "ms"}
CHI2_95: Final = 5.991464547107979
"""Quantile of χ² with 2 degrees of freedom."""


def estimate_figures(run: EstimatorRun, alignment: FrameFit) -> dict[str, Any]:
    """Return the figures as a JSON object."""
    jumps, drifts = _jumps_and_drifts(run)
    return {
        "duration_s": run.duration_s,
        "started_at_s": run.starts_s[-1] if run.starts_s else None,
        "fixes": _fixes(run),
        "jumps": {
            "accepted": len(jumps),
            "largest_m": max((jump.moved_m for jump in jumps), default=0.0),
            "divergences": len(drifts) + run.strays,
            "largest_divergence_m": max((run.stray_most_m, *(drift.moved_m for drift in drifts))),
            "contradicted_s": run.contradicted_s,
        },
        "consistency": _consistency(run),
        "differs_from_files": _constants(run),
        "error": error_figures(run, alignment),
        "verdict": verdict(run),
    }


def _jumps_and_drifts(run: EstimatorRun) -> tuple[list[AcceptedJump], list[AcceptedJump]]:
    """Return the moves of the position after jumps of the receiver, and those after drifts of the estimate."""
    moves = [each.jump for each in run.jumps]
    return [each for each in moves if each.of_receiver], [each for each in moves if not each.of_receiver]


def _fixes(run: EstimatorRun) -> dict[str, Any]:
    kinds, used = run.receiver[:, 4], run.fixes[:, 6]
    with_place = kinds > 0
    counted = run.consistency
    return {
        "received": len(kinds),
        "fixed_pct": _pct(kinds == 3),
        "reported_sigma_median_m": float(np.median(run.receiver[with_place, 3])) if with_place.any() else None,
        "judged": len(used),
        "accepted": int(used.sum()),
        "accepted_pct": _pct(used > 0),
        "rejected": int((used == 0).sum()),
        "too_late": counted.fixes_too_late,
        "duplicate": counted.fixes_duplicate,
    }


def _consistency(run: EstimatorRun) -> dict[str, Any] | None:
    """Return NIS of the used fixes and of all, against χ² and against the assumed distribution."""
    if not len(run.fixes):
        return None
    nis, used = run.nis, run.fixes[:, 6] > 0
    share = (1.0 + nis / (FIX_DOF - 2.0)) ** (-0.5 * FIX_DOF)
    counted, correlation = run.consistency, fixes_whiteness(run.white, run.fix_lag)
    return {
        "fix_nis_mean": float(run.fixes[used, 5].mean()) if used.any() else None,
        "fix_nis_mean_expected": 2.0,
        "fix_nis_median": float(np.median(nis)),
        "beyond_chi2_95_pct": _pct(nis > CHI2_95),
        "outlying_pct": _pct(share < OUTLYING),
        "outlying_expected_pct": 100.0 * OUTLYING,
        "innovation_rms_m": float(np.sqrt((run.fixes[used, 3:5] ** 2).sum(axis=1).mean())) if used.any() else None,
        "innovations_correlated": correlation.correlation if correlation else None,
        "innovations_correlated_by_chance": correlation.by_chance if correlation else None,
        "wheel_nis_mean": counted.encoder_nis_mean,
        "wheel_nis_mean_expected": 2.0,
        "wheels_rejected": counted.encoders_rejected,
        "unmodelled_walk_most_m_rtm": run.wander_most_m_rtm,
        "position_sigma_m": counted.position_sigma_m,
        "heading_sigma_rad": counted.heading_sigma_rad,
    }


def _constants(run: EstimatorRun) -> dict[str, Any]:
    """Return what the robot's constants differ by from its files; what the drive has not told is None."""
    return {
        f"{each.name.replace(' ', '_')}_{_UNIT_NAMES[each.unit]}": [each.difference, each.sigma] if each.told else None
        for each in run.constants
    }


def error_figures(run: EstimatorRun, alignment: FrameFit) -> dict[str, Any] | None:
    """Return the estimate's distance from the reference; None without a reference."""
    if not len(run.reference) or not run.starts_s:
        return None
    compared = aligned(run, alignment)
    if not len(compared.time_s):
        return None
    off_m = np.hypot(*compared.error_m.T)
    turn = wrapped_all(compared.heading_error_rad)
    known, claimed = np.isfinite(turn), compared.covariance
    place = claimed[:, :2, :2]
    distance = np.einsum("ni,nij,nj->n", compared.error_m, np.linalg.inv(place), compared.error_m)
    claimed_m = float(np.sqrt(np.trace(place, axis1=1, axis2=2).mean()))
    heading_rms = float(np.sqrt((turn[known] ** 2).mean())) if known.any() else None
    return {
        "against": "truth" if run.emulated else "reference",
        "alignment": alignment.value,
        "points": len(off_m),
        "mean_m": float(off_m.mean()),
        "p95_m": float(np.percentile(off_m, 95)),
        "max_m": float(off_m.max()),
        "heading_rms_rad": heading_rms,
        "error_over_claimed": float(np.sqrt((off_m**2).mean())) / claimed_m,
        "heading_over_claimed": heading_rms / float(np.sqrt(claimed[known, 2, 2].mean())) if heading_rms else None,
        "nees_of_position": float(distance.mean()),
        "nees_of_position_expected": 2.0,
        "inside_3_sigma_pct": _pct(distance < _THREE_SIGMA),
    }


def verdict(run: EstimatorRun) -> list[str]:
    """Return violations of the estimator's assumptions, a line each."""
    if run.misfits:  # all else follows from that
        return [does_not_fit([each]) for each in run.misfits]
    if run.problem:
        return [run.problem]
    if not run.starts_s:
        return [f"the estimator never started: {_why_not(run)}"]
    against = []
    accepted = _pct(run.fixes[:, 6] > 0)
    if accepted is not None and accepted < LEAST_ACCEPTED_PCT:
        against.append(
            f"outside of its design: of the fixes {accepted:.0f} % are accepted, the others contradict the estimate "
            f"({run.contradicted_s:,.0f} s in all); a robot would stand still meanwhile"
        )
    if not len(run.receiver):
        return against + _inconsistent(run)
    sheet = run.setup.onboard.gnss
    sheet_m = math.sqrt(sheet.white_m**2 + sheet.gauss_markov_1_m**2 + sheet.gauss_markov_2_m**2)
    reported_m = float(np.median(run.receiver[run.receiver[:, 4] > 0, 3]))
    if reported_m > SIGMA_FACTOR * sheet_m:
        against.append(
            f"outside of its design: fixes report σ {reported_m:.2g} m (median), the receiver's data sheet says "
            f"{sheet_m:.2g} m; set gnss.white_m and gnss.gauss_markov_… of the mapping's onboard to what it is"
        )
    return against + _inconsistent(run)


def _inconsistent(run: EstimatorRun) -> list[str]:
    """Return why the claimed accuracy is not to be believed, a line each."""
    if run.reversals:  # all else follows from that
        return [f"not consistent: the log {against_the_wheels(run.reversals, run.duration_s)}; {UNSIGNED}"]
    against, correlation, wheels = [], fixes_whiteness(run.white, run.fix_lag), run.consistency.encoder_nis_mean
    remedy = "`touchline calibrate` looks for the cause"
    _, drifts = _jumps_and_drifts(run)
    if drifts or run.strays:
        moved_m = max((run.stray_most_m, *(drift.moved_m for drift in drifts)))
        count = len(drifts) + run.strays
        against.append(
            f"not consistent: the estimate strayed from the fixes {'once' if count == 1 else f'{count} times'}, by up "
            f"to {moved_m:.2f} m, though the receiver had not jumped; {remedy}"
        )
    if correlation is not None and correlation.found and correlation.correlation > 0.0:  # else σ is too large
        against.append(
            f"not consistent: {compared_innovations(run.fix_lag)} are correlated by {correlation.correlation:.2f}, "
            f"where chance explains {correlation.by_chance:.2f}, so the noise figures are wrong; "
            f"{_raised(run)}; {remedy}"
        )
    elif run.wander_most_m_rtm > 0.0:
        against.append(f"not consistent: innovations of fixes were correlated at times; {_raised(run)}; {remedy}")
    if wheels > MOST_WHEEL_NIS:
        against.append(
            f"not consistent: the wheels' readings have an NIS of {wheels:.1f}, where 2 is expected: they slip, or the "
            f"vehicle's radii or track are wrong; {remedy}"
        )
    return against


def _raised(run: EstimatorRun) -> str:
    """Return by how much the claimed σ has been raised for it."""
    if run.wander_most_m_rtm == 0.0:
        return "the claimed σ is not to be believed"
    walk_mm = 1e3 * run.wander_most_m_rtm
    return f"the claimed σ has been raised by a walk of up to {walk_mm:.0f} mm over a metre"


def _why_not(run: EstimatorRun) -> str:
    kinds = run.receiver[:, 4]
    if run.setup.vehicle.positioning == ODOMETRY:
        return "it needs the robot to stand for 0.25 s; if its wheels read a little at rest, give wheels.standing_mps"
    if not len(kinds):
        return "there are no fixes"
    if not (kinds == 3).any():
        return "none of the fixes is RTK-fixed (fixes.taken_as of the mapping takes them for it)"
    return "it needs a fixed position while the robot stands for 0.25 s"


def _pct(flags: NDArray[np.bool_]) -> float | None:
    return 100.0 * float(flags.mean()) if len(flags) else None
