"""Team algorithms of `examples/teams` with faults and half of all messages lost: contacts, and what proofs promise.

`python -m benchmarks team_faults`; `seeds` runs of each from seed `first`, teams of `least` to `most` robots, `only`
one algorithm, `avoid` one way to keep apart, all for a `share` of their time. A share of all messages is lost (`loss`):
those between robots, and those to and from the coordinator, of which the others are up to `delay` s late. 40 % of the
robots have a fault (`random_team_faults`): by cells lost poses, blocked wheels, bumpers, empty batteries, computers
that hang; by plans and barriers lost poses and empty batteries, with which robots can follow their plans.

Columns: contacts of two robots whose wheels obey, and with walls; updates; least distance (m) of two plans that robots
follow or may be following, or of two stopping segments; the same that robots really follow; updates in which it is less
than promised; most by which a robot was off its plan, or outside its cell (m); robots with a fault, that stopped, and
runs in which all were stopped as one was off its plan or cell.

Promised are 2·r_s by plans and barriers. Cells allow for errors of the estimate: twice the body's radius.
"""

import math
from collections import Counter
from time import perf_counter
from typing import Final

import numpy as np

from benchmarks._settings import Small
from benchmarks._team_cases import CASES, Case, team_of
from touchline.coordination.plans.plan_kernels import Claims, closest_plans_m
from touchline.core import timed_motion as t
from touchline.jobs.team.random_team_faults import with_random_faults
from touchline.jobs.team.team_figures import team_figures
from touchline.jobs.team.team_run import TeamRun

SIZES: Final = (4, 10, 50)
AVOID: Final = ("cells", "plans", "barriers")
ROUNDING_M: Final = 1e-9
SMALL = Small(
    {"least": 4, "most": 4, "seeds": 1, "share": 0.1, "only": "straight"},
    (
        "# seeds from #, #% of messages lost, the others up to # s late",
        "straight 4 cells 0 0 # # - 0 # # # 0",
        *(f"straight 4 {avoid} 0 0 # # # 0 # # # 0" for avoid in ("plans", "barriers")),
        "0 contacts, 0 updates with less than promised",
    ),
)


class WatchedRun(TeamRun):
    """Run that looks at every update how far apart the plans are that robots really follow.

    Attributes:
        followed_m: The least distance so far; inf by cells.
        updates: Updates so far.
        short: Updates with less than promised.
    """

    followed_m, updates, short = math.inf, 0, 0

    def _note(self) -> None:
        super()._note()
        self.updates += 1
        nearest_m, promised_m = self.guide.believed.nearest_m, 2.0 * self.body_radius_m
        if self.team.by_plans:
            self.followed_m = min(self.followed_m, self._followed_m())
            nearest_m, promised_m = min(nearest_m, self.followed_m), 2.0 * self.team.radius_m
        self.short += nearest_m < promised_m - ROUNDING_M

    def _followed_m(self) -> float:
        """Return the least distance (m) from now on of two plans that robots follow."""
        plans = [self.robots[name].emulator.onboard.followed_plan for name in self.names]
        steps = max(len(samples) for samples, _ in plans) + 1
        rest = np.zeros((len(plans), steps, t.COLUMNS))
        for who, (samples, start_s) in enumerate(plans):
            for step in range(steps):
                if len(samples):
                    t.motion_at(samples, self.ticks / 100.0 - start_s + step * t.STEP_S, rest[who, step])
                else:
                    rest[who, step, :2] = self.places()[who]
        known = [who for who, (samples, _) in enumerate(plans) if len(samples)]
        return float(closest_plans_m(Claims(np.ascontiguousarray(rest[known]), np.arange(len(known)))))


def main(
    least: int = 10,
    most: int = 10,
    seeds: int = 5,
    first: int = 1,
    only: str = "",
    avoid: str = "",
    share: float = 1.0,
    loss: float = 0.5,
    delay: float = 0.2,
) -> None:
    """Print a row for each algorithm, size of a team, and way to keep robots apart."""
    print(f"{seeds} seeds from {first}, {loss:.0%} of messages lost, the others up to {delay:g} s late")
    print(
        f"{'algorithm':16}  robots  avoid     touch  walls  updates  least m  followed m  short  off m   "
        "faulty  stopped  all stopped  s"
    )
    sums = Counter[str]()
    for robots in (robots for robots in SIZES if least <= robots <= most):
        for case in (case for case in CASES if case.avoid != ("none",) and only in ("", case.name)):
            for way in (avoid,) if avoid else AVOID:
                _print_row(case, robots, way, range(first, first + seeds), (share, loss, delay), sums)
    print(f"{sums['contacts']} contacts, {sums['short']} updates with less than promised")


def _print_row(
    case: Case, robots: int, avoid: str, seeds: range, settings: tuple[float, float, float], sums: Counter[str]
) -> None:
    """Print the figures of some runs, and add them to the sums."""
    begun_s, found = perf_counter(), [_figures(case, robots, avoid, seed, *settings) for seed in seeds]
    touch, walls, updates, nearest_m, followed_m, short, off_m, faulty, stopped, ended = np.array(found).T
    wall_s = perf_counter() - begun_s
    followed = "         -" if math.isinf(followed_m.min()) else f"{followed_m.min():10.4f}"
    sums["contacts"] += int(touch.sum() + walls.sum())
    sums["short"] += int(short.sum())
    print(
        f"{case.name:16}  {robots:6}  {avoid:8}  {touch.sum():5.0f}  {walls.sum():5.0f}  {updates.sum():7.0f}  "
        f"{nearest_m.min():7.4f}  {followed}  {short.sum():5.0f}  {off_m.max():.4f}  "
        f"{faulty.sum():6.0f}  {stopped.sum():7.0f}  {ended.sum():11.0f}  {wall_s / len(seeds):.1f}",
        flush=True,
    )


def _figures(
    case: Case, robots: int, avoid: str, seed: int, share: float, loss: float, delay_s: float
) -> tuple[float, ...]:
    """Return the figures of a run, in the order of the columns."""
    healthy = team_of(case, robots, avoid, seed, share, loss, links=loss, delay_s=delay_s)
    faulty = with_random_faults(healthy, seed)
    team = faulty.model_copy(update={"links": healthy.links, "onboard": healthy.onboard})
    run = WatchedRun(team)
    run.run()
    figures = team_figures(run, 1.0)
    walls = [run.names[k] for k in run.contacts.at_walls if run.names[k] not in run.disobedient]
    believed = run.guide.believed
    return (
        figures["contacts_of_obedient"],
        len(walls),
        run.updates,
        believed.nearest_m,
        run.followed_m,
        run.short,
        believed.outside_m,
        len({*team.faults, *team.frozen}),
        len(figures["stopped"]),
        bool(run.guide.problem),
    )
