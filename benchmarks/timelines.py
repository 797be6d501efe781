"""Jobs among things that no plan knows: contacts, how each job ends, what is left out, and the time that it costs.

`python -m benchmarks timelines`; `runs` random timelines from `seed` on, of the `fields` by turns, with 5 to 40 things
of which a third move at walking speed: templates by name, their parts `penalty-area` and `small-pan`, and `goals`. What
a report says is left out is compared with a raster of the truth. Ends with exit code 1 after a contact in motion, or if
a report is not true.
"""

import sys
import time
from collections import Counter
from typing import NamedTuple

from benchmarks._settings import Small
from benchmarks._timeline_jobs import Met, job_named
from touchline.schemas.errors import TouchlineError

SMALL = Small(
    {"runs": 1, "fields": "study-square"},
    (
        "# study-square # things # drives # contacts in motion (#) # at rest # done # left out # s (# alone) in # s",
        "# jobs: # contacts in motion, # with the robot at rest; # reports not true",
        "study-square # jobs",
    ),
)


class Row(NamedTuple):
    """A timeline."""

    field: str
    met: Met

    @property
    def moving(self) -> list[float]:
        """Speeds of the robot at contacts in motion."""
        return [each["robot_mps"] for each in self.met.contacts if each["robot_mps"] > 0.0]


def main(runs: int = 200, seed: int = 1, fields: str = "soccer-7,salt-pan,goals") -> None:
    """Run the jobs, and print the figures."""
    names = fields.split(",")
    jobs = {name: job_named(name) for name in names}
    rows = list[Row]()
    for number in range(seed, seed + runs):
        name, begun = names[number % len(names)], time.process_time()
        try:
            rows.append(Row(name, jobs[name](number)))
        except TouchlineError as error:
            raise SystemExit(f"timeline {number}: {error}") from error
        _print(number, rows[-1], time.process_time() - begun)
    untrue, moving = sum(row.met.untrue for row in rows), sum(len(row.moving) for row in rows)
    at_rest = sum(len(row.met.contacts) for row in rows) - moving
    print(f"{len(rows)} jobs: {moving} contacts in motion, {at_rest} with the robot at rest; {untrue} reports not true")
    for name in names:
        mine = [row.met for row in rows if row.field == name]
        if mine:
            work, left_out = sum(each.done for each in mine), sum(each.left_out for each in mine)
            longer = sum(each.time_s for each in mine) / sum(each.alone_s for each in mine)
            endings = dict(Counter(each.reason.split(":")[0] or "finished" for each in mine))
            print(
                f"{name} {len(mine)} jobs: {endings}; {100.0 * left_out / (work + left_out):.1f} % left out; ", end=""
            )
            print(f"{longer:.2f} times as long")
    if untrue or moving:
        sys.exit(1)


def _print(number: int, row: Row, took_s: float) -> None:
    met, fastest = row.met, max(row.moving, default=0.0)
    at_rest = len(met.contacts) - len(row.moving)
    print(
        f"{number:4} {row.field:12} {met.things:3} things {met.drives:3} drives {len(row.moving):2} contacts ", end=""
    )
    print(f"in motion ({fastest:.2f}) {at_rest:3} at rest {met.done:7.2f} done {met.left_out:6.2f} left out ", end="")
    print(f"{met.time_s:6.1f} s ({met.alone_s:.1f} alone) in {took_s:.0f} s  ", end="")
    print(f"{'NOT TRUE  ' if met.untrue else ''}{met.reason or 'finished'}", flush=True)
