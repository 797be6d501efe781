"""Every package that the product imports is declared."""

import re
import sys
import tomllib
from collections.abc import Iterator
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
#: Distributions that a declared one is built on, and brings.
BROUGHT = {"cv2": "opencv-python-headless", "llvmlite": "numba", "pynmeagps": "pyubx2", "pydantic_core": "pydantic"}
#: One import, as the formatter writes them; a syntax tree of every file takes seconds.
IMPORT = re.compile(r"^ *(?:import|from) (\w+)[\w.]*(?: import .*| as \w+)?$", re.MULTILINE)
#: Loaded by its host alone.
HOSTS = {"pytest"}


def imported(folder: str) -> Iterator[str]:
    """Top-level modules that the files of a folder import, anywhere in them."""
    for path in (ROOT / folder).rglob("*.py"):
        yield from IMPORT.findall(path.read_text(encoding="utf-8"))


def named(requirements: list[str]) -> set[str]:
    """Distributions of a list of requirements, in the spelling of PEP 503."""
    return {re.split(r"[<>=!~\[ ;]", each)[0].lower().replace("_", "-") for each in requirements}


@pytest.mark.parametrize("folder", ["schemas", "services", "src", "tui", "research"])
def test_every_package_that_is_imported_is_declared(folder: str) -> None:
    declared = set()
    for file in (ROOT / "pyproject.toml", ROOT / folder / "pyproject.toml"):  # of its own it has beside the product's
        project = tomllib.loads(file.read_text(encoding="utf-8"))["project"] if file.exists() else {}
        extras = project.get("optional-dependencies", {})
        declared |= named(project.get("dependencies", []))
        for extra in extras.keys() - {"docs", "test"}:
            declared |= named(extras[extra])
    modules = set(imported(folder)) - set(sys.stdlib_module_names) - HOSTS - {"touchline"}
    brought_by = packages_distributions()
    for module in sorted(modules):
        names = {
            BROUGHT.get(name.replace("-", "_"), name).lower().replace("_", "-")
            for name in brought_by.get(module, [module])
        }
        assert names & declared, f"{folder} imports {module}, which no dependency in pyproject.toml brings"
