"""Touchline is one package: folders of a user's own with the names of its parts do not get into its way."""

import os
import subprocess
import sys
from importlib.metadata import distribution
from pathlib import Path

PARTS = ("schemas", "services", "tui")
IMPORT_ALL = """
import importlib, pkgutil
for part in ("touchline", *("touchline." + part for part in {parts})):  # a checkout has these at its top
    for module in pkgutil.walk_packages(importlib.import_module(part).__path__, part + "."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
            print(module.name)
"""


def test_foreign_packages_of_the_parts_names_on_the_path(tmp_path: Path):
    for part in PARTS:
        (tmp_path / part).mkdir()
        (tmp_path / part / "__init__.py").write_text(f"raise SystemExit('the {part} of somebody else')")
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    ran = subprocess.run(
        [sys.executable, "-c", IMPORT_ALL.format(parts=PARTS)],
        check=False,
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
    )
    assert ran.returncode == 0, ran.stderr
    imported = ran.stdout.split()
    assert {"touchline.tui.app", "touchline.services.planner.service", "touchline.schemas.cdr"} <= set(imported)


def test_nothing_but_touchline_is_installed():
    assert (distribution("touchline").read_text("top_level.txt") or "").split() == ["touchline"]
