"""Options from touchline.toml and from the environment."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from touchline.cli.commands import command_line
from touchline.cli.settings_file import command_of, defaults_for, set_options, settings
from touchline.schemas.errors import SpecError

TEXT = """
[simulate]
seed = 9
follower = "pure-pursuit"
paint-speed = 0.9
set = ["length=20"]

[fleet.simulate]
robots = 3
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "touchline.toml").write_text(TEXT, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_file_sets_options_by_their_names(folder: Path) -> None:
    found = defaults_for(command_of(command_line("simulate")), settings())
    assert found["simulate"] == {"seed": 9, "follower": "pure-pursuit", "paint_speed": 0.9, "settings": ["length=20"]}


def test_the_environment_comes_before_the_file_and_both_are_listed(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TOUCHLINE_SIMULATE_SEED", "4")
    found = {(each.command, each.option): (each.value, each.source) for each in set_options(command_line())}
    assert found[("simulate", "--seed")] == ("4", "TOUCHLINE_SIMULATE_SEED")
    assert found[("simulate", "--follower")] == ("pure-pursuit", "touchline.toml")
    assert found[("fleet simulate", "--robots")] == ("3", "touchline.toml")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[simulate]\nsed = 9\n", r"simulate\.sed is not an option; did you mean 'seed'"),
        ("[simulat]\nseed = 9\n", "simulat is not a subcommand; did you mean 'simulate'"),
        ("[simulate\n", "cannot be used"),
    ],
)
def test_a_wrong_name_is_refused_with_the_right_one(folder: Path, text: str, words: str) -> None:
    (folder / "touchline.toml").write_text(text, encoding="utf-8")
    with pytest.raises(SpecError, match=words):
        list(set_options(command_line()))


def test_a_command_takes_them_and_its_own_options_come_first(
    folder: Path, touchline: Callable[..., tuple[int, str, str]]
) -> None:
    (folder / "touchline.toml").write_text("[plan]\npaint-speed = 0.4\n", encoding="utf-8")
    took = [touchline("plan", "study-square", "--json", *more) for more in ((), ("--paint-speed", "0.5"))]
    paint_s = [json.loads(out)["time_s"]["paint"] for _, out, _ in took]
    assert paint_s[0] / paint_s[1] == pytest.approx(0.5 / 0.4, rel=0.01)
