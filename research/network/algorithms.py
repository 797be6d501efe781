"""Tables of algorithms: each from the same starts, with every way to keep robots apart."""

from collections.abc import Iterable, Sequence
from itertools import product
from pathlib import Path
from typing import Any, Final

import numpy as np

from touchline_research.network import wishes
from touchline_research.network.deployments import keeps_apart
from touchline_research.network.team_trials import Avoid, TeamRecord, TeamRules, TeamTrial, by_team, listed
from touchline_research.target_table import TargetRow, TargetTable, against_targets

EXAMPLES: Final = Path(__file__).resolve().parents[2] / "examples" / "teams"
NO_EXAMPLES: Final = "The examples of algorithms are not here, their rows are left out: run it in the repository."
SWAP_S, SCATTERED_S = 60.0, 60.0
_WISHES: Final = Path(wishes.__file__).resolve()
_APART: Final[tuple[Avoid, ...]] = ("none", "cells", "plans", "barriers")
_UNSAFE_OR_PLANS: Final[tuple[Avoid, ...]] = ("none", "plans")
_SCATTERED: Final = (
    "rendezvous.py:Rendezvous",
    "cyclic_pursuit.py:CyclicPursuit",
    "formation.py:Formation",
    "flocking.py:Flocking",
    "learned_coverage.py:LearnedCoverage",
    "dispersion.py:Dispersion",
    "perimeter.py:Perimeter",
    "leader_election.py:LeaderElection",
    "auction.py:Auction",
    "capt.py:Capt",
)
_COMMON: Final = ("contacts", "closest", "driven each", "changed", "by m/s, rad/s", "rounds", "messages, bytes")
SWAP_COLUMNS: Final = ("wishes", "apart by", "all arrived after", "arrived", "worst / median, Jain", *_COMMON)
SCATTERED_COLUMNS: Final = ("algorithm", "apart by", "Jain of driven", *_COMMON)


def swap_rules() -> list[TeamRules]:
    """Rules by which teams change places: what is not installed or not here is left out."""
    found = {"straight velocities": f"{_WISHES}:Straight"}
    if EXAMPLES.is_dir():
        found |= {"ORCA, by radio": f"{EXAMPLES}/orca.py:Orca", "BVC, by radio": f"{EXAMPLES}/bvc.py:Bvc"}
    if wishes.has_pyrvo():
        found["ORCA's library, all known"] = f"{_WISHES}:OrcaLibrary"
    found |= {"goals": "", "ways on a grid": "grid-ways"}
    return [
        TeamRules(name, avoid, use=use) for (name, use), avoid in product(found.items(), _APART) if _drives(use, avoid)
    ]


def _drives(use: str, avoid: str) -> bool:
    """Return whether robots wish anything that can be granted to all: goals without an algorithm are not wishes."""
    return bool(use) or avoid != "none"


def scattered_rules() -> list[TeamRules]:
    """Rules of algorithms without goals."""
    if not EXAMPLES.is_dir():
        return []
    return [
        TeamRules(use.partition(".")[0].replace("_", " "), avoid, use=f"{EXAMPLES}/{use}")
        for use, avoid in product(_SCATTERED, _UNSAFE_OR_PLANS)
    ]


def algorithm_trials(robots: int, seeds: int, share: float) -> list[TeamTrial]:
    """Runs of both tables.

    Args:
        robots: Number of robots.
        seeds: Number of seeds of each.
        share: Share of the time of each run.
    """
    swaps = product(swap_rules(), range(1, seeds + 1))
    found = [TeamTrial(rules, robots, seed, "swap", share * SWAP_S) for rules, seed in swaps]
    scattered = product(scattered_rules(), range(1, seeds + 1))
    return [*found, *(TeamTrial(rules, robots, seed, "deploy", share * SCATTERED_S, True) for rules, seed in scattered)]


def algorithm_tables(records: Sequence[TeamRecord]) -> tuple[TargetTable, TargetTable]:
    """Create the tables of runs of `algorithm_trials`."""
    first = records[0].trial
    title = f"{first.robots} robots change places: wishes, and what keeps apart"
    note = (
        "All rows have the same starts. Changed is the share of wishes that were changed, with the mean change over "
        "all wishes. Worst / median and Jain's index are of the times at which robots came to their goals for good, or "
        "of the end. Rounds, messages and bytes are of the radio between robots, means of the runs."
    )
    missing = [
        text for text, there in ((wishes.INSTALL, wishes.has_pyrvo()), (NO_EXAMPLES, EXAMPLES.is_dir())) if not there
    ]
    swaps = by_team(record for record in records if record.trial.task == "swap")
    scattered = by_team(record for record in records if record.trial.scattered)
    duration_s = scattered[0][0].trial.duration_s if scattered else 0.0
    return (
        TargetTable(title, SWAP_COLUMNS, tuple(map(_swap_row, swaps)), " ".join((note, *missing))),
        TargetTable(
            f"Examples of algorithms, {first.robots} robots from the same scattered starts, {duration_s:g} s",
            SCATTERED_COLUMNS,
            tuple(map(_scattered_row, scattered)),
            "Jain's index is of the distances driven.",
        ),
    )


def jain(values: Sequence[float]) -> float:
    """Return Jain's index of fairness: 1 if all values are the same, 1/n if all but one of n are 0."""
    return float(np.sum(values) ** 2 / (len(values) * np.sum(np.square(values)))) if np.any(values) else 1.0


def _swap_row(group: Sequence[TeamRecord]) -> TargetRow:
    goals = [record.figures["goals"] for record in group]
    arrived_s = [each["all_arrived_s"] for each in goals if each["all_arrived_s"] is not None]
    arrived, robots = sum(each["arrived"] for each in goals), sum(record.trial.robots for record in group)
    worst = [max(record.arrivals_s) / float(np.median(record.arrivals_s)) for record in group]
    fairness = [jain(record.arrivals_s) for record in group]
    own = (
        listed(arrived_s, ".1f", " s") if len(arrived_s) == len(group) else "never",
        f"{arrived} of {robots}",
        f"{max(worst):.2f}, {min(fairness):.3f}" if arrived == robots else "–",
    )
    return _row(group, own, {"arrived": arrived, "jain_least": min(fairness)})


def _scattered_row(group: Sequence[TeamRecord]) -> TargetRow:
    fairness = [jain(record.trace.driven_m.tolist()) for record in group]
    return _row(group, (f"{min(fairness):.3f}",), {"jain_least": min(fairness)})


def _row(group: Sequence[TeamRecord], own: tuple[str, ...], figures: dict[str, float]) -> TargetRow:
    rules = group[0].trial.rules
    contacts = [record.figures["contacts"] for record in group]
    closest_m = min(record.figures["closest_m"] for record in group)
    changes = _means(record.figures["intervention"] for record in group)
    radios = [record.figures.get("algorithm", {}).get("radio") for record in group]
    radio = _means(each for each in radios if each)
    cells = (
        rules.name,
        rules.avoid,
        *own,
        listed(contacts, "d"),
        f"{closest_m:.3f} m",
        listed([record.figures["driven_mean_m"] for record in group], ".1f", " m"),
        f"{changes['changed_share']:.1%}",
        f"{changes['mean_change_mps']:.4f}, {changes['mean_change_radps']:.4f}",
        f"{radio['rounds']:.0f}" if radio else "–",
        f"{radio['sent']:,.0f}, {radio['sent_bytes']:,.0f}" if radio else "–",
    )
    asked = keeps_apart(group) if rules.ours else []
    figures = figures | {"contacts": sum(contacts), "closest_m": closest_m, "changed": changes["changed_share"]}
    return TargetRow(cells, *against_targets(asked), figures)


def _means(figures: Iterable[dict[str, Any]]) -> dict[str, float]:
    """Return the means of all numbers of some objects with the same names."""
    found = list(figures)
    names = [name for name, value in found[0].items() if isinstance(value, int | float)] if found else []
    return {name: float(np.mean([each[name] for each in found])) for name in names}
