"""Team of every run of a sweep, and the figures of a run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from touchline.core.stopwatch import Stopwatch
from touchline.jobs.team.random_team_faults import with_random_faults
from touchline.jobs.team.team_figures import team_figures
from touchline.jobs.team.team_run import TeamRun
from touchline.schemas.scenario import Scenario
from touchline.schemas.team import TeamScenario


@dataclass(frozen=True)
class TeamJob:
    """Team, whatever its world's seed.

    Attributes:
        team: The team.
        random_faults: Whether each seed has its own timeline of faults.
    """

    team: TeamScenario
    random_faults: bool = False

    def drive(self, world: Scenario) -> dict[str, Any]:
        """Simulate a run in a world and return its figures.

        Raises:
            TouchlineError: The team cannot drive.
        """
        watch = Stopwatch()
        team = self.team.model_copy(update={"world": world})
        run = TeamRun(with_random_faults(team, world.seed) if self.random_faults else team)
        run.run()
        return team_figures(run, watch.elapsed_s)


def swept_figures(figures: dict[str, Any]) -> dict[str, float]:
    """Return the numbers of a run that a sweep summarises."""
    deployed, goals = figures.get("deploy", {}), figures.get("goals", {})
    counted = ("contacts", "contacts_of_obedient", "closest_m", "driven_mean_m", "beyond_walls_robot_s")
    found = {name: figures[name] for name in counted}
    found |= {
        "cost_of_points": deployed.get("of_points"),
        "cost_of_squares": deployed.get("of_squares"),
        "spread_s": deployed.get("spread_s"),
        "arrived_s": goals.get("all_arrived_s"),
        "total_time_s": figures["time_s"],
    }
    return {name: float(value) for name, value in found.items() if value is not None}
