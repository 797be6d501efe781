"""The corpora of the fuzzers, read without another error than Touchline's."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.fuzz.targets import CORPUS, TARGETS, corpus


def test_every_target_has_a_corpus_and_all_together_are_small() -> None:
    assert {each.name for each in CORPUS.iterdir()} == set(TARGETS)
    assert all(any(corpus(name)) for name in TARGETS)
    assert sum(each.stat().st_size for each in CORPUS.rglob("*") if each.is_file()) <= 200_000


@pytest.mark.parametrize("name", TARGETS)
def test_a_corpus_is_read(name: str) -> None:
    for path in corpus(name):
        TARGETS[name](path.read_bytes())


@pytest.mark.full
@pytest.mark.timeout(3600)
def test_ten_seconds_of_each_fuzzer_find_nothing() -> None:
    pytest.importorskip("atheris", reason="pip install -e '.[fuzz]'")
    command = [sys.executable, "-m", "tests.fuzz", "--seconds", "10"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=Path(__file__).parents[2])
    assert done.returncode == 0, done.stdout + done.stderr
