"""Touchline is one package: folders of a user's own with the names of its parts do not get into its way."""

import os
import re
import subprocess
import sys
from importlib.metadata import distribution
from pathlib import Path

ROOT = Path(__file__).parents[2]
PARTS = ("schemas", "services", "tui")
IMPORT = "import touchline.cli, touchline.schemas.cdr, touchline.services.planner.plan, touchline.tui.operator"


def test_foreign_packages_of_the_parts_names_on_the_path(tmp_path: Path):
    for part in PARTS:
        (tmp_path / part).mkdir()
        (tmp_path / part / "__init__.py").write_text(f"raise SystemExit('the {part} of somebody else')")
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    ran = subprocess.run(
        [sys.executable, "-c", IMPORT],
        check=False,
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
    )
    assert ran.returncode == 0, ran.stderr


def test_no_module_imports_a_part_by_its_bare_name():
    """In a checkout that would work, for these are at its top."""
    bare = re.compile(rf"^\s*(from|import) ({'|'.join(PARTS)})\b", re.MULTILINE)
    files = [path for part in ("src", *PARTS) for path in (ROOT / part).rglob("*.py")]
    assert len(files) > 300
    assert [path for path in files if bare.search(path.read_text(encoding="utf-8"))] == []


def test_nothing_but_touchline_is_installed():
    assert (distribution("touchline").read_text("top_level.txt") or "").split() == ["touchline"]
