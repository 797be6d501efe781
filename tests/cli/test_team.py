"""`--robots N`: what is refused, and the report of two robots."""

import json
from pathlib import Path

import pytest

from tests.system.commands import touchline_here

pytestmark = pytest.mark.xdist_group("two robots")  # by one worker, so that what tests share is done once


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (("simulate", "study-square", "--robots", "5"), "4 swaths, too few for 5 robots; give at most 4"),
        (("simulate", "soccer-11-grass", "--robots", "2"), "share lines alone"),
        (("run", "study-square", "--robots", "2", "--robot", "r1"), "--robot is given with --robots"),
        (("run", "study-square", "--robots", "2", "--follower", "external"), "is 'external'"),
        (("run", "tennis", "--take-over-after", "5"), "--take-over-after is given without --robots"),
        (("simulate", "tennis", "--robot-order", "20:1:fail"), "--robot-order is given without --robots; give"),
        (("simulate", "tennis", "--robots", "2", "--robot-order", "20:fail"), "has 2 of 3 parts; write T:ROBOT:WORD"),
        (("simulate", "tennis", "--robots", "2", "--robot-order", "nan:1:fail"), "has the time 'nan'; give seconds"),
        (("simulate", "tennis", "--robots", "2", "--robot-order", "-1:1:fail"), "has the time '-1'; give seconds"),
        (
            ("simulate", "tennis", "--robots", "2", "--robot-order", "5:3:fail"),
            "has the robot '3'; give a number from 1 to 2",
        ),
        (
            ("simulate", "tennis", "--robots", "2", "--robot-order", "5:1:die"),
            "has the word 'die'; use one of pause, resume,",
        ),
        (("simulate", "study-square", "--robots", "2"), "cannot be shared among 2 robots"),
    ],
)
def test_what_several_robots_cannot_do_is_refused(touchline, arguments, problem):
    code, _, said = touchline(*arguments)
    assert code == 2 and problem in " ".join(said.split())


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    """A file of a template of four rows."""
    lines = [((0, 4 * k), (8, 4 * k)) for k in range(4)]
    segments = [{"id": f"row-{k}", "line": {"start": a, "end": b}} for k, (a, b) in enumerate(lines)]
    template = tmp_path_factory.mktemp("rows") / "rows.json"
    template.write_text(json.dumps({"name": "rows", "segments": segments}))
    return str(template)


def ordered(rows, *orders, options=()):
    given = [part for order in orders for part in ("--robot-order", order)]
    done = touchline_here("simulate", rows, "--robots", "2", "--json", *given, *options)
    return done.returncode, json.loads(done.stdout), " ".join(done.stderr.split())


@pytest.fixture(scope="module")
def undisturbed(rows):
    picture = Path(rows).with_suffix(".png")
    code, told, said = ordered(rows, options=("--hash", "--plot", str(picture)))
    assert code == 0, said
    assert picture.stat().st_size > 10_000
    return told


def test_the_report_is_of_both_together_and_of_each(undisturbed):
    told = undisturbed
    assert told["success"] and told["paint"]["coverage_pct"] > 99.8
    assert told["traversal"]["closest_bodies_m"] >= 0.5 and told["orders"] == []
    assert sorted(name for own in told["robots"].values() for name in own["segments"]) == [f"row-{k}" for k in range(4)]
    hashes = told["hash"]["robots"]
    assert set(hashes) == {"r1", "r2"} and told["hash"]["session"]
    assert hashes["r1"] != hashes["r2"], "of another seed"


def test_orders_have_the_other_do_the_rest_and_what_came_of_each_is_told(rows, undisturbed):
    late = ("110:2:remove", "110:2:take-over")
    code, told, said = ordered(
        rows, "20:2:take-over", "21:2:fail", "22:2:fail", "30:2:take-over", *late, options=("--hash",)
    )
    assert code == 0, said
    assert told["paint"]["coverage_pct"] > 99.8 and told["traversal"]["left_out_m"] == 0.0
    came = [(each["at_s"], each["robot"], each["order"], each["done"]) for each in told["orders"]]
    assert came == [
        (20.0, "r2", "take-over", False),
        (21.0, "r2", "fail", True),
        (22.0, "r2", "fail", False),
        (30.0, "r2", "take-over", True),
        (110.0, "r2", "remove", True),
        (110.0, "r2", "take-over", True),
    ]
    assert "m cannot be reached" in told["orders"][3]["outcome"] and "r1: row-" in told["orders"][5]["outcome"]
    assert "nothing: r2 has not failed" in said and "110 s: r2 remove: carried away" in said
    assert len(told["robots"]["r1"]["taken_over"]) == 2 and told["robots"]["r2"]["taken_over"] == []
    assert set(told["hash"]["robots"]) == {"r1", "r1 (2)", "r1 (3)", "r2"}
    assert told["hash"]["robots"]["r2"] != undisturbed["hash"]["robots"]["r2"]


def test_a_pause_longer_than_patience_is_waited_for_where_an_order_ends_it(rows, monkeypatch):
    monkeypatch.setattr("touchline.jobs.shared.shared_simulation.PATIENCE_S", 15.0)
    code, told, said = ordered(rows, "10:1:pause", "10:2:pause", "30:1:resume", "31:2:resume")
    assert code == 0, said
    assert told["traversal"]["total_time_s"] > 30.0 and all(each["done"] for each in told["orders"])


def test_when_nobody_is_left_the_rest_is_refused_and_the_job_fails(rows):
    code, told, _ = ordered(rows, "10:1:fail", "11:2:fail", "12:1:take-over")
    assert code == 1 and not told["success"] and "has no robot that can do it" in told["reason"]
    assert not told["orders"][2]["done"] and "has no robot" in told["orders"][2]["outcome"]
