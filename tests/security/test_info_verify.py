"""``touchline info --verify``, with identities as `touchline keys` issues them."""

import json
from pathlib import Path

import pytest
from click.testing import Result
from typer.testing import CliRunner

from tests.bridge.said import messages
from tests.command import app
from touchline.recordings.recorder import Recorder
from touchline.recordings.recording_file import RecordingError
from touchline.schemas.cdr import encode
from touchline.schemas.errors import SpecError
from touchline.schemas.roles import Role
from touchline.schemas.user_folders import keys_folder
from touchline.security.authority import CertificateAuthority
from touchline.security.identity import Identity


@pytest.fixture
def recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A recording of two seconds, signed by an identity in the default folder of keys."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    CertificateAuthority.create(keys_folder())
    with CertificateAuthority.changing(keys_folder()) as authority:
        authority.issue([authority.new_member(Role.BRIDGE, "main")])
    recorder = Recorder(tmp_path / "a.mcap", signer=Identity.load("bridge.main"))
    for number, (topic, message) in enumerate(messages(200)):
        recorder.write(topic.name, encode(message), number)
    return recorder.finish().path


def info(*options: str | Path) -> Result:
    return CliRunner().invoke(app, ["info", *map(str, options)])


def test_a_recording_is_verified_with_the_authority_of_the_keys(recording: Path) -> None:
    found = info(recording, "--verify")
    assert found.exit_code == 0, found.output
    assert "as recorded by bridge.main" in found.stdout and "sealed to the end" in found.stdout
    figures = json.loads(info(recording, "--verify", "--json").stdout)
    (file,) = figures["verification"]["files"]
    assert figures["verification"]["verdict"] == file["verdict"] == "as recorded"
    assert file["messages"] == figures["messages"] and file["until_s"] == 1.99 and file["path"] == str(recording)
    assert "verification" not in json.loads(info(recording, "--json").stdout)


def test_exit_code_1_unless_all_is_as_recorded(recording: Path, tmp_path: Path) -> None:
    recording.write_bytes(recording.read_bytes()[:-1])
    found = info(recording, "--verify", "--json")
    assert found.exit_code == 1 and json.loads(found.stdout)["verification"]["verdict"] == "changed"
    unsigned = Recorder(tmp_path / "b.mcap").finish().path
    found = info(unsigned, "--verify")
    assert found.exit_code == 1 and "not signed" in found.stdout


def test_the_files_of_a_folder_are_verified_one_by_one(recording: Path) -> None:
    result = info(recording.parent, "--verify")
    assert isinstance(result.exception, RecordingError) and "one by one" in str(result.exception)


def test_another_authority(recording: Path, tmp_path: Path) -> None:
    CertificateAuthority.create(tmp_path / "other")
    found = info(recording, "--verify", "--authority", tmp_path / "other" / "ca.pem")
    assert found.exit_code == 1 and "not trusted" in found.stdout and "is not issued by the authority" in found.stdout


def test_without_an_authority_it_says_how_to_give_one(
    recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "no.pem").write_text("no")
    for options, said in (
        (("--authority", tmp_path / "no.pem"), "no.pem is not a certificate"),
        (("--authority", tmp_path / "none.pem"), "none.pem cannot be read"),
    ):
        result = info(recording, "--verify", *options)
        assert isinstance(result.exception, SpecError) and said in str(result.exception)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "empty"))
    result = info(recording, "--verify")
    assert isinstance(result.exception, SpecError) and "--authority ca.pem" in str(result.exception)
