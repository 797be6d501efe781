"""Files of several robots: what they may leave out, the files that they name, and what is wrong with them."""

import json
from pathlib import Path

import pytest

from touchline.schemas.errors import SpecError
from touchline.schemas.fleet import Fleet
from touchline.schemas.scenario import MAX_SEED
from touchline.schemas.setup import Setup

NARROW = {"drive": {"kind": "differential", "track_width_m": 0.45}}
WIDEST = {"drive": {"kind": "differential", "track_width_m": 99}}
SHIPPED = Path(__file__).parents[2] / "examples" / "three-robots.json"


def written(folder: Path, *robots: object, **files: object) -> Path:
    """A fleet's file, and others beside it."""
    for name, content in files.items():
        (folder / f"{name}.json").write_text(json.dumps(content))
    path = folder / "robots.json"
    path.write_text(json.dumps({"robots": robots}))
    return path


def test_what_is_left_out_is_as_by_default(tmp_path):
    assert Fleet.read(written(tmp_path, {"namespace": "r1"})).setups() == {"r1": Setup()}


def test_parts_are_given_in_place_or_by_the_name_of_a_file_beside_it(tmp_path):
    path = written(
        tmp_path,
        {"namespace": "r1", "vehicle": "narrow.json", "scenario": {"seed": 4}, "seed": 7},
        {"namespace": "club/r2", "vehicle": NARROW, "scenario": "wet.json", "onboard": "pure.json"},
        narrow=NARROW,
        wet={"ground": {"surface": "wet-grass"}, "seed": 5},
        pure={"follower": "pure-pursuit"},
    )
    first, second = Fleet.read(path).setups().values()
    assert first.vehicle == second.vehicle
    assert first.vehicle.drive.track_width_m == 0.45
    assert (first.scenario.seed, second.scenario.seed) == (7, 5)
    assert second.scenario.ground.surface == "wet-grass"
    assert second.onboard.follower == "pure-pursuit"
    assert first.onboard.follower == "mpc"


@pytest.mark.parametrize(
    ("robots", "told"),
    [
        ([], r"robots\.json: robots"),
        ([{}], r"robots\.json: robots\[0\]\.namespace is missing"),
        ([{"namespace": "a b"}], r"robots\[0\]\.namespace is 'a b'.*letters"),
        ([{"namespace": "r1"}, {"namespace": "r1"}], r"robots\[1\]\.namespace is 'r1', as is an earlier one's"),
        ([{"namespace": "r1", "sed": 1}], r"robots\[0\]\.sed is not a known field"),
        ([{"namespace": "r1", "seed": -1}], r"robots\[0\]\.seed is -1"),
        ([{"namespace": "r1", "vehicle": WIDEST}], r"robots\[0\]\.vehicle\.drive\.track_width_m is 99"),
        ([{"namespace": "r1", "vehicle": "absent.json"}], r"absent\.json.*cannot be read"),
        ([{"namespace": "r1", "vehicle": "broken.json"}], r"broken\.json: drive\.track_width_m is 99"),
        ([{"namespace": "r1", "scenario": {"follower": "mpc"}}], r"robots\[0\]\.scenario.*follower"),
        (["r1"], r"robots\[0\] is a JSON string"),
    ],
)
def test_what_is_wrong_is_told_with_file_field_and_remedy(tmp_path, robots, told):
    with pytest.raises(SpecError, match=told):
        Fleet.read(written(tmp_path, *robots, broken=WIDEST))


def test_a_fleet_survives_being_written(tmp_path):
    setups = Fleet.read(SHIPPED).setups()
    path = tmp_path / "again.json"
    path.write_text(Fleet.of(setups).model_dump_json())
    assert Fleet.read(path).setups() == setups
    assert list(setups) == ["r1", "r2", "r3"]
    assert len({setup.vehicle.name for setup in setups.values()}) == 2


def test_seeds_that_count_up_begin_anew_after_the_largest():
    assert Setup().with_seed(MAX_SEED + 1).scenario.seed == 0
