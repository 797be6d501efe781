"""Lists and pins of what is installed, and no committed secrets."""

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from importlib.metadata import requires, version
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.house import secrets

ROOT = Path(__file__).parents[2]


def needed(name: str, extras: frozenset[str], seen: set[tuple[str, frozenset[str]]]) -> Iterator[str]:
    """The packages that a package needs with some extras, itself included."""
    if (name, extras) in seen:
        return
    seen.add((name, extras))
    yield name
    for requirement in map(Requirement, requires(name) or ()):
        if any(requirement.marker is None or requirement.marker.evaluate({"extra": each}) for each in (*extras, "")):
            yield from needed(canonicalize_name(requirement.name), frozenset(requirement.extras), seen)


INSTALLED = frozenset(needed("touchline", frozenset({"standard"}), set())) - {"touchline"}


def test_the_sbom_names_every_package_with_version_and_licence(tmp_path: Path) -> None:
    made = tmp_path / "sbom.json"
    command = [sys.executable, "-m", "cyclonedx_py", "environment", "--no-validate", "-o", str(made), sys.executable]
    subprocess.run(command, check=True, capture_output=True)
    listed = {canonicalize_name(each["name"]): each for each in json.loads(made.read_text())["components"]}
    assert len(INSTALLED) > 40
    assert {name: listed[name]["version"] for name in INSTALLED} == {name: version(name) for name in INSTALLED}
    assert [name for name in INSTALLED if not listed[name].get("licenses")] == []


def test_every_package_is_pinned_by_hash_in_the_version_of_the_constraints() -> None:
    constraints = dict(line.split("==") for line in (ROOT / "constraints.txt").read_text().split())
    pinned = {canonicalize_name(name): number for name, number in constraints.items()}
    text = (ROOT / "deploy" / "requirements.txt").read_text().replace("\\\n", "")
    locked = {line.split()[0]: line.split()[1:] for line in text.splitlines() if not line.startswith("#")}
    found = {canonicalize_name(name): number for name, number in (package.split("==") for package in locked)}
    assert found == {name: pinned[name] for name in found}
    assert found.keys() >= INSTALLED
    hashes = [each for some in locked.values() for each in some]
    assert all(locked.values()) and all(re.fullmatch(r"--hash=sha256:[0-9a-f]{64}", each) for each in hashes)
    assert "://" not in text


@pytest.mark.parametrize(
    "parts",
    [
        ("-----BEGIN EC ", "PRIVATE KEY-----\n"),
        ("AKIA", "ABCDEFGHIJKLMNOP"),
        ("ghp_", "a" * 36),
        ("glpat-", "a" * 20),
        ("xoxb-", "0123456789"),
        ("eyJhbGciOiJIUzI1", "NiJ9.eyJzdWIiOiIxMjM0NTY3ODkwIn0.x"),
        ("tls://user", ":secret@10.0.0.1"),
    ],
)
def test_secrets_are_seen(parts: tuple[str, str]) -> None:
    assert secrets(f'x = "{"".join(parts)}"'.encode())
    assert not secrets(parts[1].encode())
