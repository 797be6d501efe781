"""Leader election: all agree on a leader by telling each other of the best candidate, and drive to it.

Each robot draws a number in each epoch and passes on the greatest that it knows of, with where that robot is. Messages
may be lost, so all repeat them at every update; a leader that fails is replaced in the next epoch. After as many rounds
as the longest way between two robots has hops, more if messages are lost, all know it. Flooding: Lynch, "Distributed
Algorithms", Morgan Kaufmann, 1996, chapter 4; random numbers: Itai, Rodeh, Information and Computation 88(1), 1990.
"""

import json
import random

from touchline.team_algorithms import HOLD, GoalWish, Me, Wish


class LeaderElection:
    """Election every `epoch_s`; the others drive to the leader, up to `near_m` from it."""

    def __init__(self, epoch_s: float = 30.0, near_m: float = 1.0) -> None:
        self._epoch_s, self._near_m = epoch_s, near_m
        self._best: tuple[int, int, str, float, float, float] = (-1, 0, "", 0.0, 0.0, 0.0)

    @property
    def leader(self) -> str:
        """Name of the leader."""
        return self._best[2]

    def start(self, me: Me) -> None:
        pass

    def heard(self, sender: str, payload: bytes, age_s: float) -> None:
        self._best = max(self._best, tuple(json.loads(payload)))

    def decide(self, me: Me) -> tuple[Wish, bytes | None]:
        epoch = int(me.now_s // self._epoch_s)
        number = random.Random(f"{me.seed} {epoch} {me.name}").randrange(10**6)  # noqa: S311
        # the later epoch counts, then the greater number, then the later news of the same robot
        self._best = max(self._best, (epoch, number, me.name, me.now_s, round(me.x_m, 2), round(me.y_m, 2)))
        *_, x_m, y_m = self._best
        far = abs(complex(x_m - me.x_m, y_m - me.y_m)) > self._near_m
        return GoalWish(x_m, y_m) if far else HOLD, json.dumps(self._best).encode()
