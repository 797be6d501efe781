"""Figures of the wishes of a team: what was changed, and what its algorithm answered and sent."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from touchline.coordination.algorithms.algorithm_task import AlgorithmTask
from touchline.coordination.interventions import Interventions
from touchline.coordination.tasks import TeamTask


def wish_figures(task: TeamTask, interventions: Interventions) -> dict[str, Any]:
    """Return figures as a JSON object.

    Args:
        task: The team's task.
        interventions: Changes of its wishes.
    """
    changes = {"intervention": interventions.figures()}
    if not isinstance(task, AlgorithmTask):
        return changes
    decider = task.decider
    wrong = {name: {**book.counts, "first": book.first} for name, book in decider.books.items() if book.counts}
    held = sorted(name for name, book in decider.books.items() if book.dismissed)
    radio = {} if decider.radio_figures is None else {"radio": asdict(decider.radio_figures)}
    return {**changes, "algorithm": {"use": task.use, "wrong_answers": wrong, "held": held, **radio}}


def why_held(figures: Mapping[str, Any]) -> str:
    """Return why robots hold until the run ends, of these figures; empty if none does."""
    algorithm = figures.get("algorithm", {})
    held = algorithm.get("held", [])
    first = f"algorithm.wrong_answers.{held[0]}: {algorithm['wrong_answers'][held[0]]['first']}" if held else ""
    return f"the algorithm of {len(held)} robots is not asked any more: {first}" if held else ""
