"""The names that `import touchline` offers, what they cost, and what type checkers see of them."""

import ast
import inspect
import json
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import touchline
import touchline.plugins

#: Signatures and fields; changed only together with a line in CHANGELOG.md (`python -m tests.api.signatures`).
HELD = Path(__file__).with_name("signatures.json")


def in_a_new_process(code: str) -> str:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout


def test_an_import_loads_nothing_heavy_and_lists_every_name() -> None:
    heavy = ("numpy", "numba", "scipy", "zenoh", "pydantic", "shapely", "typer", "matplotlib")
    code = f"import sys, touchline; print([m for m in {heavy!r} if m in sys.modules], len(dir(touchline)))"
    assert in_a_new_process(code) == f"[] {len(touchline.__all__)}\n"


def test_a_recording_is_read_without_planner_numba_and_bus() -> None:
    heavy = ("numba", "zenoh", "scipy", "shapely")
    code = f"import sys, touchline; touchline.Recording; print([m for m in {heavy!r} if m in sys.modules])"
    assert in_a_new_process(code) == "[]\n"


@pytest.mark.parametrize("module", [touchline, touchline.plugins], ids=lambda each: each.__name__)
def test_the_stub_has_the_same_names_from_the_same_modules(module: ModuleType) -> None:
    found = {}
    for node in ast.parse(Path(str(module.__file__)).with_suffix(".pyi").read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ImportFrom):
            found |= {each.asname: node.module for each in node.names}
    assert found == {name: place for name, place in module._PUBLIC.items() if name != "__version__"}
    assert all(hasattr(module, name) for name in dir(module))


def test_every_name_is_there_and_documented() -> None:
    for name in touchline.__all__:
        found = getattr(touchline, name)
        assert name == "__version__" or inspect.getdoc(found), name


def test_signatures_change_only_on_purpose() -> None:
    from tests.api.signatures import signatures

    assert signatures() == json.loads(HELD.read_text(encoding="utf-8")), (
        "see CHANGELOG.md and `python -m tests.api.signatures`"
    )


def test_the_subject_is_positional_and_all_else_by_name() -> None:
    for name in touchline.__all__:
        found = getattr(touchline, name)
        if inspect.isfunction(found):
            kinds = [each.kind for each in inspect.signature(found).parameters.values()]
            positional = [kind for kind in kinds if kind is inspect.Parameter.POSITIONAL_ONLY]
            assert len(positional) <= 1, name
            assert inspect.Parameter.POSITIONAL_OR_KEYWORD not in kinds, name
