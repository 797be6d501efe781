"""Run the benchmarks: every module here has ``main()``, which prints its figures."""

import importlib
import os
import platform
import sys
from pathlib import Path

LONG = frozenset(
    (
        "coverage",
        "fields",
        "fleet_recorded",
        "goals",
        "random_fields",
        "shared",
        "stops",
        "visits",
        "kills",
        "recording_kills",
        "recording_rate",
        "soak",
    )
)
"""Minutes to hours: run only when named."""


def available() -> list[str]:
    """Names of the benchmark modules."""
    return sorted(path.stem for path in Path(__file__).parent.glob("*.py") if not path.stem.startswith("_"))


def main() -> None:
    """Run those named on the command line, or all but the long ones."""
    names = sys.argv[1:] or [name for name in available() if name not in LONG]
    unknown = sorted(set(names) - set(available()))
    if unknown:
        sys.exit(f"no benchmark {', '.join(unknown)}; there are: {', '.join(available())}")
    print(f"{platform.platform()}, {os.cpu_count()} cores, Python {platform.python_version()}")
    for name in names:
        print(f"\n== {name}")
        importlib.import_module(f"benchmarks.{name}").main()


main()
