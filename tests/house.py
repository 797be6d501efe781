"""Measures of the code, printed by `make lint`: the largest functions, the longest signatures, the deepest nesting.

Behind that, by room, how many functions have more parameters than there should be. Subcommands, which Typer registers
by `app.command`, are left out of what is said of parameters: theirs are the options of the command line.

Ends with exit code 1 if a function has more than PARAMETERS_LIMIT parameters or nests deeper than NESTING_LIMIT, if a
public class or a module name stands for two things, if a docstring begins with a question word, if documentation or a
docstring uses a word that another one stands for, if a line of the documentation is too long, or if a committed file
holds a secret.
"""

import ast
import re
import subprocess
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
PARTS = ("schemas", "services", "src", "tui", "research")
#: Of these only the wording is held to rules.
BESIDE = ("benchmarks", "examples", "tests")
SHOWN = 5
#: What there should be at most, and what is refused; the limit comes down as the functions beyond do.
PARAMETERS_MOST, PARAMETERS_LIMIT = 6, 7
NESTING_LIMIT = 4
#: Characters of a line of documentation; tables and code may be wider.
PROSE_LIMIT, TABLE_LIMIT = 120, 160
#: Words that another one stands for (docs/reference/glossary.md).
REPLACED = {
    "errand": "assignment",
    "errands": "assignments",
    "judge": "evaluate",
    "judged": "evaluated",
    "judges": "evaluates",
    "judging": "evaluating",
    "conduct": "behaviour",
}
QUESTION = re.compile(r"\W*(What|Which|Who|Whose|Whom|Where|When|Whether|Why|How)\b")
#: Names that say in every room what the room's file is for.
COMMON_MODULES = frozenset(("__init__", "service"))
#: The public interface calls things as its users do, whatever has that name inside.
PUBLIC, PLUGINS = Path("src/touchline/api"), Path("src/touchline/plugins.py")
#: Methods of a Typer application that make a subcommand of a function.
REGISTERING = frozenset(("command", "callback"))
#: Private keys, tokens of the usual providers and of the web, and addresses with a password.
SECRET = re.compile(
    rb"-----BEGIN [A-Z ]*PRIVATE KEY-----|\bAKIA[0-9A-Z]{16}\b|\bAIza[\w-]{35}|\bgh[pousr]_\w{36}|\bgithub_pat_\w{22}|"
    rb"\bglpat-[\w-]{20}|\bxox[abprs]-[\w-]{10}|\bpypi-AgE\w{20}|\bnpm_\w{36}|\bsk-[\w-]{32}|"
    rb"\beyJ[\w-]{10,}\.eyJ[\w-]{10,}\.|://[^/\s:@\"'{}]+:[^/\s:@\"'{}]+@"
)
NESTING = (ast.If, ast.For, ast.While, ast.With, ast.Try, ast.Match)


class Function(NamedTuple):
    """One function: lines of its body, parameters but `self` (0 of a subcommand), and how deep its statements nest."""

    place: str
    lines: int
    parameters: int
    nesting: int


def sources(parts: tuple[str, ...]) -> Iterator[tuple[Path, ast.Module]]:
    """Every module in some folders."""
    for part in parts:
        for path in sorted((ROOT / part).rglob("*.py")):
            yield path.relative_to(ROOT), ast.parse(path.read_text(encoding="utf-8"))


def statements(node: ast.AST) -> Iterator[ast.AST]:
    """All statements in a module or a statement, however deep, with what is between them: cases and handlers."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.stmt | ast.excepthandler | ast.match_case):
            yield child
            yield from statements(child)


def functions(path: Path, tree: ast.Module) -> Iterator[Function]:
    """Those of a module, the methods of its classes included."""
    commands = subcommands(tree)
    for node in statements(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            given = node.args
            names = {each.arg for each in (*given.posonlyargs, *given.args, *given.kwonlyargs)} - {"self", "cls"}
            lines = (node.end_lineno or node.lineno) - node.lineno + 1
            parameters = 0 if node.name in commands else len(names)
            yield Function(f"{path}:{node.lineno} {node.name}", lines, parameters, depth(node))


def subcommands(tree: ast.Module) -> set[str]:
    """Names of functions that the module registers: `@app.command()`, `app.command("x")(f)` or `…(with_groups(f))`."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and any(map(registers, node.decorator_list)):
            found.add(node.name)
        elif isinstance(node, ast.Call) and registers(node.func):
            found |= {name.id for argument in node.args for name in ast.walk(argument) if isinstance(name, ast.Name)}
    return found


def registers(node: ast.expr) -> bool:
    """Return whether it is a call like `app.command("x")`."""
    return isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in REGISTERING


def depth(node: ast.AST) -> int:
    """Depth of the nesting of statements in it; an `elif` is as deep as its `if`."""
    if isinstance(node, ast.If) and len(node.orelse) == 1 and isinstance(node.orelse[0], ast.If):
        inside = max(map(depth, node.body))
        return max(inside + 1, depth(node.orelse[0]))
    inner = max((depth(child) for child in ast.iter_child_nodes(node) if not isinstance(child, ast.expr)), default=0)
    return inner + isinstance(node, NESTING)


def by_room(found: list[Function]) -> str:
    """Number of functions in each room that are beyond the limits."""
    rooms = Counter("/".join(function.place.removeprefix("src/").split("/")[:2]) for function in found)
    return ", ".join(f"{room} {count}" for room, count in rooms.most_common()) or "none"


def names(path: Path, tree: ast.Module) -> Iterator[str]:
    """Names that one thing alone may have: that of the module, and of its public classes."""
    if path.stem not in COMMON_MODULES and path != PLUGINS:
        yield f"module {path.stem}"
    for node in tree.body:
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_") and PUBLIC not in path.parents:
            yield f"class {node.name}"


def docstrings(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Texts that stand alone in a module, a class or a function, with their lines."""
    for node in (tree, *statements(tree)):
        for each in getattr(node, "body", ()) if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) else ():
            match each:
                case ast.Expr(value=ast.Constant(value=str(text))):
                    yield each.lineno, text


def pages() -> Iterator[tuple[Path, str]]:
    """Every page of the documentation."""
    for path in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))):
        yield path.relative_to(ROOT), path.read_text(encoding="utf-8")


def replaced(place: str, text: str) -> Iterator[str]:
    """Find words that another one stands for."""
    for word in REPLACED.keys() & set(re.findall(r"[a-z]+", text.lower())):
        yield f"{word}: use {REPLACED[word]}: {place}"


def wording(path: Path, tree: ast.Module) -> Iterator[str]:
    """Find what is wrong with the docstrings of a module."""
    for line, text in docstrings(tree):
        yield from replaced(f"{path}:{line}", text)
        if QUESTION.match(text):
            yield f"begins with a question word: {path}:{line}"


def wording_of_pages() -> Iterator[str]:
    """Find what is wrong with pages."""
    for path, text in pages():
        yield from replaced(str(path), text)
        fenced = False
        for number, line in enumerate(text.splitlines(), start=1):
            fenced ^= line.lstrip().startswith("```")
            if len(line) > (TABLE_LIMIT if fenced or line.startswith("|") else PROSE_LIMIT):
                yield f"{len(line)} characters: {path}:{number}"


def secrets(text: bytes) -> list[bytes]:
    """First bytes of what looks like a key, a token or a password."""
    return [found[:24] for found in SECRET.findall(text)]


def committed() -> Iterator[Path]:
    """Every file of the repository."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout
    return (path for name in listed.split("\0") if (path := ROOT / name).is_file())


def main() -> None:
    """Print it."""
    found, named, worded = list[Function](), defaultdict[str, list[str]](list), list[str]()
    for path, tree in sources(PARTS):  # one at a time: looking through all of them for garbage would take longer
        found += functions(path, tree)
        for name in names(path, tree):
            named[name].append(str(path))
        worded += wording(path, tree)
    for path, tree in sources(BESIDE):
        worded += wording(path, tree)
    for name in ("lines", "parameters", "nesting"):
        most = sorted(found, key=lambda function: getattr(function, name), reverse=True)[:SHOWN]
        print(f"most {name}: " + "; ".join(f"{getattr(function, name)} {function.place}" for function in most))
    print(f"more than {PARAMETERS_MOST} parameters: {by_room([f for f in found if f.parameters > PARAMETERS_MOST])}")
    problems = [f"{f.parameters} parameters: {f.place}" for f in found if f.parameters > PARAMETERS_LIMIT]
    problems += [f"nests {f.nesting} deep: {f.place}" for f in found if f.nesting > NESTING_LIMIT]
    problems += [
        f"one name for several things: {name}: {', '.join(paths)}"
        for name, paths in sorted(named.items())
        if len(paths) > 1
    ]
    problems += [*worded, *wording_of_pages()]
    problems += [
        f"a secret: {path.relative_to(ROOT)}: {each!r}" for path in committed() for each in secrets(path.read_bytes())
    ]
    if problems:
        sys.exit("\n".join(problems))


if __name__ == "__main__":
    main()
