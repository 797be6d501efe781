"""Cells, plans and barriers beside each other: contacts, times, how much wishes are changed, and computing time.

`python -m benchmarks barriers`; `robots` that change places, `seeds` runs from `first` on; then `updates` of barrier
certificates with wishes that drive at whoever is nearest.
"""

import time

import numpy as np

from benchmarks._settings import Small
from benchmarks._team_wishes import Certified, Straight
from touchline.coordination.coordination import plan_settings_of
from touchline.coordination.plans.barrier_plans import BarrierPlans
from touchline.coordination.start_poses import free_area, start_poses
from touchline.jobs.team.team_figures import team_figures
from touchline.jobs.team.team_run import TeamRun
from touchline.schemas.plugins import TEAM_ALGORITHMS
from touchline.schemas.team import TeamScenario

DURATION_S = 60.0
WISHES = {"straight": Straight, "20° right": lambda: Straight(20.0), "certified": Certified}
ROWS = (
    ("straight", "none"),
    ("certified", "none"),
    ("straight", "cells"),
    ("straight", "plans"),
    ("straight", "barriers"),
    ("20° right", "plans"),
    ("20° right", "barriers"),
    ("", "plans"),
    ("", "barriers"),
)
SMALL = Small(
    {"robots": 4, "seeds": 1, "updates": 20},
    (
        "# robots change places, # seeds from #",
        "wish by contacts closest m arrived of # s Δv m/s Δω rad/s changed %",
        *("# # # # # # # # #" for _ in ROWS),
        "barriers, # robots that drive at each other, # updates: median # ms, max # ms, # without an answer",
    ),
)


def main(robots: int = 20, seeds: int = 20, first: int = 101, updates: int = 100_000) -> None:
    """Print a row for each wish and what keeps robots apart."""
    for name, make in WISHES.items():
        TEAM_ALGORITHMS.register(name, "of this benchmark", make)
    print(f"{robots} robots change places, {seeds} seeds from {first}")
    print(f"{'wish':10} {'by':9} contacts  closest m  arrived of {robots}    s   Δv m/s  Δω rad/s  changed %")
    for wish, avoid in ROWS:
        found = np.array([_row(robots, wish, avoid, seed) for seed in range(first, first + seeds)])
        contacts, closest_m, arrived, ended_s, mps, radps, share = found.T
        print(
            f"{wish or 'own':10} {avoid:9} {contacts.sum():8.0f}  {closest_m.min():9.3f}  {arrived.min():13.0f}  "
            f"{np.median(ended_s):5.1f}  {mps.mean():7.4f}  {radps.mean():8.4f}  {100.0 * share.mean():9.1f}",
            flush=True,
        )
    for name in WISHES:
        TEAM_ALGORITHMS.forget(name)
    _time(robots, updates)


def _row(robots: int, wish: str, avoid: str, seed: int) -> tuple[float, ...]:
    """Contacts, least distance of centres (m), robots that have arrived, end (s) and changes of a run."""
    world = TeamScenario().world.model_copy(update={"seed": seed}).model_dump()
    given = {"robots": robots, "task": {"kind": "swap"}, "avoid": avoid, "world": world, "duration_s": DURATION_S}
    given |= {"algorithm": {"use": wish}} if wish else {}
    given |= {"update_s": 0.1} if wish == "certified" else {}
    run = TeamRun(TeamScenario.model_validate(given))
    run.run()
    figures = team_figures(run, 1.0)
    changes = figures["intervention"]
    means = changes["mean_change_mps"], changes["mean_change_radps"], changes["changed_share"]
    return figures["contacts"], figures["closest_m"], figures["goals"]["arrived"], run.trace.ended_s, *means


def _time(robots: int, updates: int) -> None:
    team = TeamScenario.model_validate({"robots": robots, "avoid": "barriers"})
    area = free_area(team)
    poses = np.array([(each.x_m, each.y_m, each.heading_rad) for each in start_poses(team, area).values()])
    plans, rng = BarrierPlans(poses, area, plan_settings_of(team).limits), np.random.default_rng(1)
    took_s = np.zeros(updates)
    for number in range(updates):
        apart = np.abs(plans.places[:, None] - plans.places) + np.diag(np.full(robots, np.inf))
        way = plans.places[apart.argmin(axis=1)] - plans.places
        wishes = way / np.abs(way) if number // 25 % 2 else rng.normal(size=robots) + 1j * rng.normal(size=robots)
        begun = time.perf_counter()
        plans.choose_by(wishes, range(robots))
        took_s[number] = time.perf_counter() - begun
        assert plans.closest_m >= 0.4 - 1e-9
    print(f"barriers, {robots} robots that drive at each other, {updates} updates: median ", end="")
    slowest_ms, unanswered = 1e3 * took_s.max(), plans.infeasible
    print(f"{1e3 * np.median(took_s):.2f} ms, max {slowest_ms:.1f} ms, {unanswered} without an answer")
