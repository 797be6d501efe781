"""Problems of an installation are found, with their remedies."""

import json
from importlib.metadata import PackageNotFoundError
from pathlib import Path

import pytest
from typer.testing import CliRunner

from touchline.cli import doctor_command
from touchline.cli.commands import command_line


def doctor() -> tuple[int, dict[str, dict[str, str]]]:
    done = CliRunner().invoke(command_line("doctor"), ["doctor", "--json"])
    return done.exit_code, {each["subject"]: each for each in json.loads(done.stdout)}


def test_a_sound_installation_has_no_remedy() -> None:
    code, found = doctor()
    assert code == 0 and not any(each["remedy"] for each in found.values())
    assert {"Touchline", "Python", "packages", "kernels", "bus", "clock"} <= set(found)


def test_a_missing_and_an_old_package_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def version(name: str) -> str:
        if name == "shapely":
            raise PackageNotFoundError
        return "0.1" if name == "mcap" else "99"

    monkeypatch.setattr(doctor_command, "version", version)
    monkeypatch.setattr(
        doctor_command, "requires", lambda _: ["shapely>=2.1", "mcap>=1.6", 'pytest>8; extra == "test"']
    )
    code, found = doctor()
    assert code == 1
    assert found["shapely"]["remedy"] == "pip install 'shapely>=2.1'"
    assert found["mcap"]["state"] == "is 0.1, not >=1.6"
    assert "pytest" not in found


def test_missing_kernels_and_a_run_folder_open_to_others_are_problems(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "run"))
    (tmp_path / "run" / "touchline").mkdir(parents=True, mode=0o755)
    (tmp_path / "run" / "touchline").chmod(0o755)
    code, found = doctor()
    assert code == 1
    assert "make kernels" in found["kernels"]["remedy"]
    assert "chmod 700" in found["folders"]["remedy"] and "chmod 700" in found["systems"]["remedy"]
