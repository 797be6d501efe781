"""How the house is built, printed by `make lint`: the largest functions, the longest signatures, the deepest nesting.

Ends with exit code 1 where a public class or a module name stands for two things.
"""

import ast
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
PARTS = ("schemas", "services", "tui")
SHOWN = 5
#: Names that say in every room what the room's file is for.
COMMON_MODULES = frozenset(("__init__", "service"))
NESTING = (ast.If, ast.For, ast.While, ast.With, ast.Try, ast.Match)


class Function(NamedTuple):
    """One function: lines of its body, parameters but `self`, and how deep its statements nest."""

    place: str
    lines: int
    parameters: int
    nesting: int


def sources() -> Iterator[tuple[Path, ast.Module]]:
    """Every module of the package."""
    for part in PARTS:
        for path in sorted((ROOT / part).rglob("*.py")):
            yield path.relative_to(ROOT), ast.parse(path.read_text(encoding="utf-8"))


def functions(path: Path, tree: ast.Module) -> Iterator[Function]:
    """Those of a module, the methods of its classes included."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            given = node.args
            names = [each.arg for each in (*given.posonlyargs, *given.args, *given.kwonlyargs)]
            lines = (node.end_lineno or node.lineno) - node.lineno + 1
            yield Function(f"{path}:{node.lineno} {node.name}", lines, len(set(names) - {"self", "cls"}), depth(node))


def depth(node: ast.AST) -> int:
    """How deep statements nest in it."""
    inner = max((depth(child) for child in ast.iter_child_nodes(node)), default=0)
    return inner + isinstance(node, NESTING)


def twice() -> list[str]:
    """What is called alike: public classes, and modules."""
    named: dict[str, list[str]] = defaultdict(list)
    for path, tree in sources():
        if path.stem not in COMMON_MODULES:
            named[f"module {path.stem}"].append(str(path))
        for node in tree.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                named[f"class {node.name}"].append(str(path))
    return [f"{name}: {', '.join(paths)}" for name, paths in sorted(named.items()) if len(paths) > 1]


def main() -> None:
    """Print it."""
    found = [function for path, tree in sources() for function in functions(path, tree)]
    for name in ("lines", "parameters", "nesting"):
        most = sorted(found, key=lambda function: getattr(function, name), reverse=True)[:SHOWN]
        print(f"most {name}: " + "; ".join(f"{getattr(function, name)} {function.place}" for function in most))
    if names := twice():
        sys.exit("one name for several things:\n" + "\n".join(names))


if __name__ == "__main__":
    main()
