"""Faults of the GNSS receiver: its solution, its noise and its clock."""

from __future__ import annotations

import math

from touchline.schemas import faults as f
from touchline.services.robot_sim.fault_effects.acting import Acting
from touchline.services.robot_sim.sensors.gnss_truth import FIX_NAMES
from touchline.services.robot_sim.world.effects import Effects


def gnss_outage(_fault: f.GnssOutage, effects: Effects, _acting: Acting) -> None:
    """Withhold all positions; see `ApplyFault`."""
    effects.fix_cap = FIX_NAMES["none"]


def gnss_degraded(fault: f.GnssDegraded, effects: Effects, _acting: Acting) -> None:
    """Limit the solution; the smallest claimed σ counts; see `ApplyFault`."""
    effects.fix_cap = min(effects.fix_cap, FIX_NAMES[fault.fix])
    if fault.claimed_m is not None:
        effects.claimed_m = min(effects.claimed_m or math.inf, fault.claimed_m)


def corrections_lost(_fault: f.CorrectionsLost, effects: Effects, _acting: Acting) -> None:
    """Withhold the corrections; see `ApplyFault`."""
    effects.corrections_lost = True


def gnss_wrong_fix(fault: f.GnssWrongFix, effects: Effects, _acting: Acting) -> None:
    """Offset the positions: offsets add up; see `ApplyFault`."""
    effects.gnss_offset_m += fault.east_m, fault.north_m


def gnss_noisy(fault: f.GnssNoisy, effects: Effects, _acting: Acting) -> None:
    """Add white noise: variances add up; see `ApplyFault`."""
    effects.gnss_white_m = math.hypot(effects.gnss_white_m, fault.white_m)
    if not fault.honest:
        effects.gnss_hidden_m = math.hypot(effects.gnss_hidden_m, fault.white_m)


def clock_skew(fault: f.ClockSkew, effects: Effects, acting: Acting) -> None:
    """Shift the receiver's clock; see `ApplyFault`.

    The offset is given at the fault's start; effects hold it for sim time 0.
    """
    drift = fault.drift_ppm * 1e-6
    effects.clock_offset_s += fault.offset_s - drift * acting.start_s
    effects.clock_drift += drift
