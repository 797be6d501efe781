"""How the house is built, printed by `make lint`: the largest functions, the longest signatures, the deepest nesting.

Behind that, by room, how many functions have more parameters and how many nest deeper than there should be. Ends with
exit code 1 where a public class or a module name stands for two things.
"""

import ast
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
PARTS = ("schemas", "services", "tui")
SHOWN = 5
PARAMETERS_MOST, NESTING_MOST = 6, 4
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
    """How deep statements nest in it; an `elif` is as deep as its `if`."""
    if isinstance(node, ast.If) and len(node.orelse) == 1 and isinstance(node.orelse[0], ast.If):
        inside = max(depth(child) for child in (node.test, *node.body))
        return max(inside + 1, depth(node.orelse[0]))
    inner = max((depth(child) for child in ast.iter_child_nodes(node)), default=0)
    return inner + isinstance(node, NESTING)


def by_room(found: list[Function]) -> str:
    """How many functions of each room are beyond what there should be."""
    rooms = Counter("/".join(function.place.split("/")[:2]) for function in found)
    return ", ".join(f"{room} {count}" for room, count in rooms.most_common()) or "none"


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
    print(f"more than {PARAMETERS_MOST} parameters: {by_room([f for f in found if f.parameters > PARAMETERS_MOST])}")
    print(f"nesting over {NESTING_MOST}: {by_room([f for f in found if f.nesting > NESTING_MOST])}")
    if names := twice():
        sys.exit("one name for several things:\n" + "\n".join(names))


if __name__ == "__main__":
    main()
