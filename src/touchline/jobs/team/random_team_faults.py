"""Random timelines of team faults by seed: everything that goes wrong in a bad week, at once."""

from __future__ import annotations

import json
from typing import Any, Final

import numpy as np

from touchline.schemas.faults import Fault, parse_fault
from touchline.schemas.team import LOSSY_LEASE_S, Freeze, TeamLinks, TeamScenario

_KINDS: Final = ("camera-outage", "wheel-blocked", "bumper", "battery-low", "frozen", "dead")
_KINDS_BY_PLANS: Final = ("battery-low", "camera-outage")
_FAULTY: Final = 0.4
"""Share of the robots with a fault."""
_LOSSY: Final = 0.5
"""Share of the timelines in which half of all messages are lost, and the others late."""
_STARTS_S: Final = (2.0, 20.0)
"""Start times of faults, while the team drives."""


def with_random_faults(team: TeamScenario, seed: int) -> TeamScenario:
    """Return the team with faults of some robots: lost poses, blocked wheels, dead computers, and so on.

    A team that drives by plans has those with which robots can follow them.

    Args:
        team: A team without faults.
        seed: Seed of the timeline.
    """
    rng = np.random.default_rng(seed)
    names = list(team.names)
    count = max(1, round(_FAULTY * len(names)))
    faults: dict[str, tuple[Fault, ...]] = {}
    frozen: dict[str, tuple[Freeze, ...]] = {}
    for name in rng.choice(names, count, replace=False).tolist():
        kind = rng.choice(_KINDS_BY_PLANS if team.by_plans else _KINDS)
        start_s = round(float(rng.uniform(*_STARTS_S)), 2)
        lasts_s = round(float(rng.uniform(2.0, 20.0)), 2)
        if kind in ("frozen", "dead"):
            frozen[name] = (Freeze(start_s=start_s, duration_s=lasts_s if kind == "frozen" else None),)
        else:
            faults[name] = (_fault(str(kind), start_s, lasts_s, rng),)
    changed: dict[str, Any] = {"faults": faults, "frozen": frozen}
    if rng.uniform() < _LOSSY:
        changed["links"] = TeamLinks(loss=0.5, delay_s=0.5)
        limits = team.onboard.team.model_copy(update={"lease_s": LOSSY_LEASE_S})
        changed["onboard"] = team.onboard.model_copy(update={"team": limits})
    return team.model_copy(update=changed)


def _fault(kind: str, start_s: float, lasts_s: float, rng: np.random.Generator) -> Fault:
    text: dict[str, Any] = {"kind": kind, "start_s": start_s, "duration_s": lasts_s}
    if kind == "wheel-blocked":
        text["wheel"] = str(rng.choice(["left", "right"]))
    return parse_fault(json.dumps(text))
