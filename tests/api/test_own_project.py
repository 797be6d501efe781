"""A project of somebody else's needs public names only; `make lint` checks its types."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import touchline

PROJECT = Path(__file__).parents[2] / "examples" / "own_project"


def test_it_uses_public_names_only() -> None:
    used, modules = set(), set()
    for path in PROJECT.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("touchline"):
                modules.add(node.module)
                used |= {alias.name for alias in node.names}
            elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "touchline":
                used.add(node.attr)
    assert modules == {"touchline"}
    assert used and used <= set(touchline.__all__)


def test_its_own_tests_pass() -> None:
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir", str(PROJECT), str(PROJECT)]
    env = {**os.environ, "PYTHONPATH": str(PROJECT)}
    done = subprocess.run(command, env=env, cwd=PROJECT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    assert "3 passed" in done.stdout
