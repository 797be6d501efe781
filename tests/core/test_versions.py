"""Version, changes and citation say the same; recordings say by which code they were made."""

import re
import subprocess
import tomllib
from pathlib import Path

import pytest

import touchline
from touchline.checking import session_changes
from touchline.checking.session_changes import SESSION_CHANGES, changes_since
from touchline.recordings.code_identity import code_digest, commit
from touchline.recordings.provenance import made_by, other_code

ROOT = Path(__file__).parents[2]
CHANGES = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
VERSION = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]


def test_the_package_says_this_version() -> None:
    assert touchline.__version__ == VERSION == made_by()["touchline"]


def test_the_newest_entry_is_of_this_version() -> None:
    assert re.findall(r"^## (\S+)", CHANGES, re.M)[0] == VERSION
    assert re.search(r"^version: (\S+)", (ROOT / "CITATION.cff").read_text(encoding="utf-8"), re.M)[1] == VERSION  # type: ignore[index]


def test_a_tagged_commit_has_the_version_of_its_tag() -> None:
    asked = subprocess.run(["git", "tag", "--points-at", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert all(tag == f"v{VERSION}" for tag in asked.stdout.split() if tag.startswith("v"))


def test_changes_of_sessions_are_those_of_the_log() -> None:
    told = {}
    for version, text in re.findall(r"^## (\S+)\n(.*?)(?=^## |\Z)", CHANGES, re.M | re.S):
        lines = re.findall(r"^- \*\*\[session\]\*\* (.*?)(?=^- |\Z)", text, re.M | re.S)
        told[version] = tuple(" ".join(line.split()) for line in lines)
    assert {version: lines for version, lines in told.items() if version in SESSION_CHANGES} == SESSION_CHANGES
    assert all(version in SESSION_CHANGES or not lines for version, lines in told.items())


def test_a_check_names_what_changed_since_the_version_of_a_recording(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session_changes, "SESSION_CHANGES", {"0.2.0": ("a",), "0.3.0": ("b", "c"), "0.10.0": ("d",)})
    assert changes_since("0.2.0", "") == []
    (remark,) = changes_since("0.2.0", "Touchline 0.2.0 (12345)")
    assert remark.startswith("recorded by Touchline 0.2.0 (12345), checked by ") and remark.endswith("b; c; d")
    (unknown,) = changes_since("", "Touchline of an unknown version")
    assert unknown.endswith("since then: a; b; c; d")


def test_a_recording_says_by_which_code_it_was_made() -> None:
    made = made_by()
    assert made["code"] == code_digest() and len(made["code"]) == 16
    assert re.fullmatch(r"[0-9a-f]{40}(-dirty)?|", made["commit"]) and made["commit"] == commit()
    assert other_code(made) == ""
    assert other_code({"touchline": "0.1.0", "code": "0", "commit": "abc"}) == "Touchline 0.1.0 (abc)"
    assert other_code({}) == "Touchline of an unknown version"
