"""Search for trouble: `python -m tests.trouble [FIRST LAST] [--recorded-every N] [--keep FOLDER]`, or FILE... again.

Drives the cases of these numbers, prints each that breaks a property, and keeps it, shrunk, as FOLDER/PROPERTY-N.json
(default: build/trouble). A file is driven again, recorded beside it with `--record`. Ends with exit code 1 if there was
any trouble.
"""

import argparse
import sys
import time
from collections import Counter
from pathlib import Path

from tests.trouble.case import Case, load_case
from tests.trouble.drawing import drawn
from tests.trouble.drive import CaseDrive
from tests.trouble.search import shrunk, trouble_in

KEPT = Path("build") / "trouble"


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.trouble", description=__doc__)
    parser.add_argument("what", nargs="+", help="first and last number of the cases, or files of cases")
    parser.add_argument(
        "--recorded-every", type=int, default=10, help="every so many cases are also recorded and checked"
    )
    parser.add_argument("--keep", type=Path, default=KEPT, help="folder for shrunk cases")
    parser.add_argument("--record", action="store_true", help="write FILE.mcap beside each file")
    given = parser.parse_args()
    if not given.what[0].isdigit():
        sys.exit(1 if sum([_again(Path(name), record=given.record) for name in given.what]) else 0)
    numbers = range(int(given.what[0]), int(given.what[-1]) + 1)
    sys.exit(1 if _search(numbers, given.recorded_every, given.keep) else 0)


def _again(path: Path, *, record: bool) -> bool:
    """Drive the case of a file again; return True if there is trouble."""
    case = load_case(path)
    trouble = trouble_in(case, recorded=True)
    print(f"{path}: {trouble or 'well'}")
    if record:
        CaseDrive(case, record=path.with_suffix(".mcap")).run()
    return trouble is not None


def _search(numbers: range, recorded_every: int, folder: Path) -> Counter[str]:
    begun_s, found = time.monotonic(), Counter[str]()
    for number in numbers:
        case, recorded = drawn(number), number % recorded_every == 0
        trouble = trouble_in(case, recorded=recorded)
        if trouble is None:
            continue
        found[trouble.name] += 1
        print(f"{number}: {trouble}", flush=True)
        if found[trouble.name] <= 3:
            case, trouble = shrunk(case, trouble, recorded=recorded)
            _keep(case, folder / f"{trouble.name}-{number}.json")
            print(f"    shrunk: {trouble}", flush=True)
    print(f"{len(numbers)} cases in {time.monotonic() - begun_s:.0f} s: {dict(found) or 'no trouble'}")
    return found


def _keep(case: Case, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(case.to_json())


if __name__ == "__main__":
    main()
