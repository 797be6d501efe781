"""`--robots N`: what is refused, and the report of two robots."""

import json

import pytest


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (("simulate", "study-square", "--robots", "5"), "4 swaths, too few for 5 robots; give at most 4"),
        (("simulate", "study-square", "--robots", "2", "--hash"), "--hash is given with --robots"),
        (("simulate", "study-square", "--robots", "2", "--record", "a.mcap"), "--record is given with --robots"),
        (("simulate", "salt-pan", "--vehicle", "clay-roller", "--robots", "2"), "clay-roller does not paint"),
        (("simulate", "soccer-11-grass", "--robots", "2"), "only lines are shared"),
        (("run", "study-square", "--robots", "2", "--robot", "r1"), "--robot is given with --robots"),
        (("run", "study-square", "--robots", "2", "--follower", "external"), "is 'external'"),
        (("simulate", "study-square", "--robots", "2"), "cannot be shared among 2 robots"),
    ],
)
def test_what_several_robots_cannot_do_is_refused(touchline, arguments, problem):
    code, _, said = touchline(*arguments)
    assert code == 2 and problem in " ".join(said.split())


def test_the_report_is_of_both_together_and_of_each(touchline, tmp_path):
    lines = [((0, 4 * k), (12, 4 * k)) for k in range(4)]
    segments = [{"id": f"row-{k}", "line": {"start": a, "end": b}} for k, (a, b) in enumerate(lines)]
    template, picture = tmp_path / "rows.json", tmp_path / "rows.png"
    template.write_text(json.dumps({"name": "rows", "segments": segments}))
    code, printed, said = touchline("simulate", str(template), "--robots", "2", "--json", "--plot", str(picture))
    assert code == 0, said
    told = json.loads(printed)
    assert told["success"] and told["paint"]["coverage_pct"] > 99.8
    assert told["traversal"]["closest_bodies_m"] >= 0.5
    assert sorted(name for own in told["robots"].values() for name in own["segments"]) == [f"row-{k}" for k in range(4)]
    assert picture.stat().st_size > 10_000
