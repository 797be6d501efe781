"""``touchline doctor``: problems of an installation, and their remedies."""

import os
import platform
import shutil
import sys
import time
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, requires, version
from importlib.util import find_spec
from itertools import pairwise
from typing import NamedTuple

import typer
from rich.markup import escape
from rich.table import Table

from touchline.cli.display import print_json, print_table
from touchline.cli.options import ExitCode, JsonOption
from touchline.schemas.errors import MissingExtra, TouchlineError

_LEAST_FREE_BYTES = 1_000_000_000
_LEAST_CLOCK_S = 1_700_000_000.0
_CONNECT_S = 0.3


class Finding(NamedTuple):
    """One line of the report; the remedy of a problem, or "" if all is well."""

    subject: str
    state: str
    remedy: str = ""


def register(app: typer.Typer) -> None:
    """Add the subcommand to `app`."""
    app.command("doctor")(doctor)


def doctor(*, as_json: JsonOption = False) -> None:
    """Check the installation: versions, kernels, folders, ports, clock, systems; exit code 1 if one is wrong."""
    found: list[Finding] = []
    for check in (_versions, _packages, _kernels, _folders, _bus, _systems, _clock):
        try:
            found += check()
        except MissingExtra as error:
            found.append(Finding(check.__name__.strip("_"), f"not looked at: {error}"))
        except TouchlineError as error:
            found.append(Finding(check.__name__.strip("_"), "cannot be checked", str(error)))
    if as_json:
        print_json([each._asdict() for each in found])
    else:
        table = Table(box=None, padding=(0, 2))
        for heading in ("", "subject", "state", "remedy"):
            table.add_column(heading, overflow="fold")
        for each in found:
            table.add_row("[bold red]wrong[/]" if each.remedy else "[green]ok[/]", *map(escape, each))
        print_table(table)
    if any(each.remedy for each in found):
        sys.exit(ExitCode.FAILED)


def _versions() -> Iterator[Finding]:
    from touchline.recordings.code_identity import commit, own_version

    at = commit()
    yield Finding("Touchline", f"{own_version()}{f' ({at})' if at else ''}")
    yield Finding("Python", f"{platform.python_version()}, {platform.system()} on {platform.machine()}")


def _packages() -> Iterator[Finding]:
    """Every required package, and those of extras that are installed, in a version that Touchline allows."""
    from packaging.requirements import Requirement

    problems = []
    counted = 0
    for each in map(Requirement, requires("touchline") or ()):
        try:
            here = version(each.name)
        except PackageNotFoundError:
            if each.marker is None or each.marker.evaluate({"extra": ""}):
                problems.append(Finding(each.name, "is not installed", f"pip install '{each}'"))
            continue
        counted += 1
        if not each.specifier.contains(here, prereleases=True):
            wanted = f"{each.name}{each.specifier}"
            problems.append(Finding(each.name, f"is {here}, not {each.specifier}", f"pip install '{wanted}'"))
    yield from problems or [Finding("packages", f"all {counted} in versions that are allowed")]


def _kernels() -> Iterator[Finding]:
    from touchline.core.kernel_store import cache_folder, shipped

    folder = cache_folder()
    files = list(folder.glob("*.o")) if folder.is_dir() else []
    size = sum(file.stat().st_size for file in files)
    brought = len(shipped()["results"])
    state = f"{brought} came with the package, {len(files)} compiled here ({size / 1e6:.0f} MB in {folder})"
    wanting = not brought and not files and find_spec("numba") is not None
    yield Finding("kernels", state, "the first start compiles for minutes; `make kernels` does it beforehand" * wanting)


def _folders() -> Iterator[Finding]:
    from touchline.core.kernel_store import cache_folder
    from touchline.supervision.private_folder import run_folder

    for name, folder in (("cache folder", cache_folder()), ("run folder", run_folder()), ("this folder", None)):
        place = os.path.realpath(folder or ".")
        while not os.path.exists(place):  # noqa: PTH110 - made when it is needed
            place = os.path.dirname(place)  # noqa: PTH120
        free = shutil.disk_usage(place).free
        if not os.access(place, os.W_OK):
            yield Finding(name, f"{place} cannot be written", "choose another, or change its owner")
        elif free < _LEAST_FREE_BYTES:
            yield Finding(name, f"{place} has {free / 1e6:.0f} MB free", "make room: recordings take 8 MB a minute")
        else:
            yield Finding(name, f"{place}, {free / 1e9:.0f} GB free")


def _bus() -> Iterator[Finding]:
    import socket

    from touchline.bus import BusConfig

    config = BusConfig.from_environment()
    protocol, _, address = config.endpoint.partition("/")
    host, _, port = address.rpartition(":")
    if protocol != "tcp" or not port.isdigit():
        yield Finding("bus", f"{config.endpoint} (not tried)")
        return
    try:
        with socket.create_connection((host, int(port)), _CONNECT_S):
            yield Finding("bus", f"somebody listens at {config.endpoint}")
    except OSError:
        yield Finding("bus", f"nobody listens at {config.endpoint}: no system is running there")


def _systems() -> Iterator[Finding]:
    """Systems that run, and files of those that have died."""
    from touchline.supervision.private_folder import run_folder
    from touchline.supervision.running_system import holder_of

    for path in sorted(run_folder().glob("*.pid")):
        try:
            pid = holder_of(path)
        except TouchlineError as error:
            yield Finding(f"system {path.stem}", "is locked by an unknown process", str(error))
            continue
        if pid is not None:
            yield Finding(f"system {path.stem}", f"runs as process {pid}")


def _clock() -> Iterator[Finding]:
    """A clock that goes backward, or from before this version, spoils the stamps of recordings."""
    steps = [time.time() for _ in range(1000)]
    if steps[0] < _LEAST_CLOCK_S:
        yield Finding(
            "clock", time.strftime("%Y-%m-%d %H:%M", time.gmtime(steps[0])), "set it, or start a time service"
        )
    elif any(later < earlier for earlier, later in pairwise(steps)):
        yield Finding("clock", "goes backward", "let the time service slew, not step")
    else:
        yield Finding("clock", time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime(steps[0])))
