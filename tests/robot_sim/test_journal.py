"""The journal's files: what survives a kill at any moment, torn and foreign ones."""

import subprocess
import sys
import time

import numpy as np
import pytest

from tests.robot_sim.scripted import along_x
from tests.with_full import with_full
from touchline.onboard.interface import Checkpoint
from touchline.schemas.errors import CommandRefused
from touchline.schemas.scenario import Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.journal import Journal, digest
from touchline.services.robot_sim.paint import record
from touchline.services.robot_sim.recovery_state import Totals
from touchline.services.robot_sim.setup_text import SetupText

PLAN = along_x(0, 2, 4, 5, sprayed=[0, 1, 0])
SETUP = SetupText.of(Setup())
OTHER = along_x(0, 3, sprayed=[0])
POINTS = np.arange(60.0).reshape(-1, 5)


class Paint:
    """A ledger with this many points."""

    def __init__(self, points):
        self.points = points

    def rows(self, first):
        return self.points[first:]


def totals(points):
    return Totals((19.5, 650.0, 0.25, 1.0), (7.0, 0.5, 0.25), points)


def keep(path, checkpoints, points=None):
    """Write a journal of these checkpoints, with one more point of paint each or as many as are said."""
    with Journal(path) as journal:
        assert not journal.problem
        journal.begin(digest(PLAN), SETUP)
        for number, checkpoint in enumerate(checkpoints):
            count = number if points is None else points[number]
            journal.write(checkpoint, totals(count), Paint(POINTS[:count]))


def found(path, plan=PLAN, setup=SETUP):
    with Journal(path) as journal:
        return journal.unfinished(plan, setup)


def test_it_survives_and_knows_its_trajectory(path):
    assert found(path) is None
    keep(path, [Checkpoint(0, tick / 100, None if tick % 2 else 0.5, tick, tick / 10, tick) for tick in range(7)])
    assert found(path, OTHER) is None
    checkpoint, remains = found(path)
    assert checkpoint == Checkpoint(0, 0.06, 0.5, 6, 0.6, 6)
    assert remains.totals == totals(6)
    assert np.array_equal(remains.paint, POINTS[:6])
    with Journal(path) as journal:
        journal.end()
    assert found(path) is None


@pytest.mark.parametrize(("slot", "arc_length_m", "points"), [(0, 2.0, 5), (256, 1.0, 3)])
def test_a_torn_record_leaves_the_one_before_and_its_paint(path, slot, arc_length_m, points):
    keep(path, [Checkpoint(0, 1.0, None), Checkpoint(0, 2.0, None)], [3, 5])
    raw = bytearray(path.read_bytes())
    raw[slot + 30] ^= 0xFF
    path.write_bytes(raw)
    checkpoint, remains = found(path)
    assert checkpoint.arc_length_m == arc_length_m
    assert np.array_equal(remains.paint, POINTS[:points])


def test_paint_that_the_journal_does_not_count_is_cut_off(path):
    """Killed after the paint was entered and before the journal said so; what comes then takes its place."""
    keep(path, [Checkpoint(0, 1.0, None)], [4])
    with Journal(path) as journal:
        assert journal.unfinished(PLAN, SETUP)
        journal._paint.append(POINTS[4:9])
    with Journal(path) as journal:
        checkpoint, remains = journal.unfinished(PLAN, SETUP)
        assert np.array_equal(remains.paint, POINTS[:4])
        journal.go_on()
        journal.write(checkpoint, totals(6), Paint(np.vstack((POINTS[:4], -POINTS[4:6]))))
    _, remains = found(path)
    assert np.array_equal(remains.paint, np.vstack((POINTS[:4], -POINTS[4:6])))


@pytest.mark.parametrize("damage", ["torn", "short", "missing", "foreign", "empty", "other plan"])
def test_damaged_paint_is_cut_off_where_the_damage_begins(path, damage):
    keep(path, [Checkpoint(0, 1.0, None)] * 3, [4, 8, 12])
    paint = path.with_suffix(".paint")
    raw, second = bytearray(paint.read_bytes()), 28 + 8 + 4 * 40
    if damage == "torn":
        raw[second + 100] ^= 1
    elif damage == "short":
        del raw[second + 100 :]
    elif damage == "foreign":
        raw = bytearray(b"a letter to the groundsman\n" * 40)
    elif damage == "empty":
        raw.clear()
    elif damage == "other plan":
        raw[8:24] = digest(OTHER)
    paint.write_bytes(raw)
    if damage == "missing":
        paint.unlink()
    checkpoint, remains = found(path)
    left = 4 if damage in ("torn", "short") else 0
    assert checkpoint == Checkpoint(0, 1.0, None)
    assert remains.totals.points == 12
    assert np.array_equal(remains.paint, POINTS[:left])


def test_it_goes_on_after_damage_and_what_is_lost_stays_lost(path):
    keep(path, [Checkpoint(0, 1.0, None)] * 2, [4, 8])
    paint = path.with_suffix(".paint")
    paint.write_bytes(paint.read_bytes()[: 28 + 8 + 4 * 40 + 50])
    with Journal(path) as journal:
        checkpoint, remains = journal.unfinished(PLAN, SETUP)
        journal.go_on()
        journal.write(checkpoint, totals(6), Paint(POINTS[:6]))
    _, remains = found(path)
    assert np.array_equal(remains.paint, POINTS[:6])


@pytest.mark.parametrize("content", [b"", b"another program's file " * 50])
def test_a_foreign_journal_is_none(path, content):
    path.parent.mkdir()
    path.write_bytes(content)
    assert found(path) is None
    keep(path, [Checkpoint(0, 1.0, None)], [4])
    assert found(path)


def test_a_new_traversal_forgets_the_paint_of_the_last_one(path):
    keep(path, [Checkpoint(0, 1.0, None)], [9])
    keep(path, [Checkpoint(0, 0.5, None)], [2])
    assert len(found(path)[1].paint) == 2
    assert path.with_suffix(".paint").stat().st_size == record._CHUNK


WRITER = """
import sys
from pathlib import Path
import numpy as np
from touchline.onboard.interface import Checkpoint
from touchline.services.robot_sim.journal import Journal
from tests.robot_sim.test_journal import SETUP, Paint, totals

points = np.zeros((1_000_000, 5))
points[:, 0] = np.arange(len(points))
with Journal(Path(sys.argv[1])) as journal:
    journal.begin(bytes.fromhex(sys.argv[2]), SETUP)
    for count in range(3, len(points), 3):
        journal.write(Checkpoint(0, float(count), None, count), totals(count), Paint(points[:count]))
        if count == 3:
            print("writing", flush=True)
"""


@pytest.mark.parametrize("after_s", with_full(0.05, full=(0.0, 0.111)))
def test_killed_at_any_moment_the_place_and_its_paint_are_there(path, after_s):
    command = [sys.executable, "-c", WRITER, str(path), digest(PLAN).hex()]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as writer:
        assert writer.stdout.readline() == b"writing\n"
        time.sleep(after_s)
        writer.kill()
    checkpoint, remains = found(path)
    assert checkpoint.tick == len(remains.paint) == remains.totals.points >= 3
    assert np.array_equal(remains.paint[:, 0], np.arange(checkpoint.tick))


CHANGED = {
    "vehicle": (Vehicle(tool={"nozzle_y_m": -0.5}), Scenario(), "vehicle.tool.nozzle_y_m was -0.41124, is -0.5"),
    "scenario": (
        Vehicle(),
        Scenario.model_validate({"seed": 2, "ground": {"surface": "wet-grass"}}),
        'ground.surface was "grass", is "wet-grass"; seed was 1, is 2.',
    ),
    "faults": (
        Vehicle(),
        Scenario.model_validate({"faults": [{"kind": "bumper", "start_s": 3.0}]}),
        'faults was [], is [{"duration_s": null, "kind": "bumper"',
    ),
}


@pytest.mark.parametrize("what", CHANGED)
def test_another_vehicle_or_scenario_is_refused_by_name_and_loses_nothing(path, what):
    vehicle, scenario, named = CHANGED[what]
    keep(path, [Checkpoint(0, 1.0, None)], [4])
    with pytest.raises(CommandRefused, match="load without resume to begin anew") as refusal:
        found(path, setup=SetupText.of(Setup(vehicle=vehicle, scenario=scenario)))
    assert named in str(refusal.value)
    checkpoint, remains = found(path)
    assert checkpoint == Checkpoint(0, 1.0, None)
    assert np.array_equal(remains.paint, POINTS[:4])


def test_a_scenario_of_another_name_is_the_same(path):
    keep(path, [Checkpoint(0, 1.0, None)], [4])
    assert found(path, setup=SetupText.of(Setup(scenario=Scenario(name="another"))))


def test_of_many_differences_the_first_are_told(path):
    gnss = {"white_m": 0.1, "gauss_markov_1_m": 0.1, "gauss_markov_2_m": 0.1, "float_m": 1.0, "single_m": 2.0}
    keep(path, [Checkpoint(0, 1.0, None)], [4])
    with pytest.raises(CommandRefused, match=r"gnss.gauss_markov_2_m was 0.0, is 0.1 \(and 2 more\)"):
        found(path, setup=SetupText.of(Setup(scenario=Scenario.model_validate({"gnss": gnss}))))


@pytest.mark.parametrize("content", [None, b"{}", b"\xff\xfe", b"not json"])
def test_without_the_setup_file_it_is_refused_all_the_same(path, content):
    keep(path, [Checkpoint(0, 1.0, None)], [4])
    setup = path.with_suffix(".setup")
    setup.unlink() if content is None else setup.write_bytes(content)
    with pytest.raises(CommandRefused, match="what differs is not known"):
        found(path, setup=SetupText.of(Setup(scenario=Scenario(seed=2))))
    assert found(path)
