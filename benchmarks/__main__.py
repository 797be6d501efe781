"""Run benchmarks: `python -m benchmarks [--small] [NAME ...] [SETTING=VALUE ...]`.

Without names all but the long ones are run, with `--small` all, each for seconds.
"""

import os
import platform
import sys

from benchmarks._settings import NotHereError, available, benchmark, parsed

LONG = frozenset(
    (
        "clear_away",
        "fields",
        "fleet_recorded",
        "goals",
        "mismatch",
        "names",
        "pitch",
        "protection",
        "random_fields",
        "routes",
        "shared",
        "stops",
        "team_passages",
        "team_algorithms",
        "team_plans",
        "kills",
        "soak",
    )
)
"""Minutes to hours: run only when named, or small."""


def main() -> None:
    """Run those named on the command line, with the settings there."""
    words = sys.argv[1:]
    small = "--small" in words
    settings = [word for word in words if "=" in word]
    named = [word for word in words if word not in settings and word != "--small"]
    if unknown := sorted(set(named) - set(available())):
        sys.exit(f"no benchmark {', '.join(unknown)}; there are: {', '.join(available())}")
    print(f"{platform.platform()}, {os.cpu_count()} cores, Python {platform.python_version()}")
    for name in named or [name for name in available() if small or name not in LONG]:
        print(f"\n== {name}", flush=True)
        _run(name, settings, small=small)


def _run(name: str, settings: list[str], *, small: bool) -> None:
    try:
        module = benchmark(name)
        try:
            given = parsed(module, settings)
        except ValueError as error:
            sys.exit(str(error))
        module.main(**({**module.SMALL.settings, **given} if small else given))
    except NotHereError as error:
        print(f"not run: {error}")


if __name__ == "__main__":
    main()
