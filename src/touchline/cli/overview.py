"""The list of all subcommands, read from their modules' texts: importing them takes several times as long."""

import ast
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

#: Subcommands of each module, by panel, in the order of the help.
PANELS: dict[str, dict[str, tuple[str, ...]]] = {
    "Jobs": {
        "demo_command": ("demo",),
        "plan_command": ("plan",),
        "run_command": ("run",),
        "simulate_command": ("simulate",),
        "goto_command": ("goto",),
        "fleet_command": ("fleet",),
        "sweep_command": ("sweep",),
        "study_command": ("study",),
    },
    "Drawings and robots": {
        "template_commands": ("templates",),
        "vehicle_commands": ("vehicle", "onboard"),
    },
    "The running system": {
        "system_commands": ("up", "status", "down"),
        "order_command": ("order", "fault", "topics"),
        "audit_command": ("audit",),
        "keys_command": ("keys",),
    },
    "Recordings": {
        "record_command": ("record",),
        "replay_command": ("replay",),
        "playback_command": ("playback",),
        "info_command": ("info",),
        "echo_command": ("echo",),
        "hz_command": ("hz",),
        "export_command": ("export",),
        "salvage_command": ("salvage",),
        "compare_command": ("compare",),
        "check_command": ("check",),
        "import_command": ("import",),
        "estimate_command": ("estimate",),
        "calibrate_command": ("calibrate",),
        "fit_command": ("fit",),
        "picture_command": ("picture",),
    },
    "This installation": {
        "config_command": ("config",),
        "doctor_command": ("doctor",),
    },
    "Processes, each alone": {
        "service_commands": ("planner", "robot-sim", "bridge", "coordinator", "router", "tui"),
    },
}

#: Those that join a bus.
ON_BUS = frozenset(
    (
        *("run", "goto", "fleet"),
        *("up", "status", "down", "order", "fault"),
        *("record", "replay", "playback", "echo", "hz"),
        *(name for names in PANELS["Processes, each alone"].values() for name in names),
    )
)
#: Those of the others whose work Dask's workers may do.
ON_DASK = frozenset(("sweep", "check"))


def bare() -> typer.Typer:
    """Return the command without subcommands."""
    app = typer.Typer(
        name="touchline",
        no_args_is_help=True,
        invoke_without_command=True,
        add_completion=True,
        pretty_exceptions_enable=False,
        rich_markup_mode="rich",
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback()(touchline)
    return app


def touchline(
    version: Annotated[bool, typer.Option("--version", help="Print the version and exit.", is_eager=True)] = False,
) -> None:
    """Plan, drive and record ground robots that mark lines or cover areas, emulated ones included."""
    if version:
        from touchline.recordings.code_identity import own_version

        typer.echo(f"touchline {own_version()}")
        raise typer.Exit


def overview() -> typer.Typer:
    """Return the command with subcommands that have a name and a summary, and do nothing."""
    app = bare()
    late = []  # Typer lists groups of subcommands after all others
    for panel, modules in PANELS.items():
        for module, names in modules.items():
            summaries = dict(_summaries(ast.parse(Path(__file__).with_name(f"{module}.py").read_text("utf-8"))))
            for name in names:
                summary, is_group = summaries[name]
                add = partial(app.command, name, help=summary, rich_help_panel=panel)
                late.append(add) if is_group else add()(_nothing)
    for add in late:
        add()(_nothing)
    return app


def _nothing() -> None:
    """Stand in for a subcommand."""


def _summaries(module: ast.Module) -> Iterator[tuple[str, tuple[str, bool]]]:
    """Yield the subcommands that a module registers, by `app.command("x")(f)`, `…(with_groups(f))` or `add_typer`.

    Yields:
        Name, docstring, and whether it is a group of subcommands.
    """
    docs = {each.name: ast.get_docstring(each) or "" for each in module.body if isinstance(each, ast.FunctionDef)}
    texts: dict[str, str] = {}
    groups: dict[str, str] = {}
    for node in ast.walk(module):
        match node:
            case ast.Assign(targets=[ast.Name(name)], value=ast.Constant(str(text))):
                texts[name] = text
            case ast.Assign(targets=[ast.Name(group)], value=ast.Call(keywords=given)):
                for each in given:
                    if each.arg == "help":
                        known = each.value.id if isinstance(each.value, ast.Name) else ""
                        groups[group] = texts.get(known) or str(ast.literal_eval(each.value))
            case ast.Call(func=ast.Call(func=ast.Attribute(attr="command"), args=[ast.Constant(name)]), args=[made]):
                inner = made.args[0] if isinstance(made, ast.Call) else made
                if isinstance(inner, ast.Name):
                    yield str(name), (docs.get(inner.id, ""), False)
            case ast.Call(
                func=ast.Attribute(attr="add_typer"),
                args=[ast.Name(group)],
                keywords=[ast.keyword("name", ast.Constant(name))],
            ):
                yield str(name), (groups[group], True)
