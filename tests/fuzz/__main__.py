"""Runs fuzzers, one after another: `python -m tests.fuzz [--seconds N] [NAME...]` (`pip install -e '.[fuzz]'`).

Each begins with its corpus in tests/fuzz/corpus and with what earlier runs have found in build/fuzz/NAME, to which it
adds. Ends with exit code 1 if a reader raised anything but its own errors, or one input took more than 5 s of processor
time, a minute, or 512 MB. That input is then in build/fuzz/NAME.crashes; once the reader is mended it belongs in the
corpus.
"""

import argparse
import importlib
import io
import os
import pkgutil
import re
import resource
import sys
import time
from collections.abc import Callable
from contextlib import redirect_stderr
from pathlib import Path
from types import ModuleType

import atheris

import touchline.core

#: What one input may take: processor time, time on a busy machine, memory.
MOST_S, LONGEST_S, MOST_MB = 5.0, 60, 512
LONGEST_BYTES = 16 * 1024
#: Packages whose branches guide the fuzzers: ours, and those that read for it.
GUIDING = ("cssselect2", "ezdxf", "mcap", "pynmeagps", "pyubx2", "ruamel", "tinycss2", "tomllib", "touchline")
FOUND = Path("build") / "fuzz"
CORPUS = Path(__file__).with_name("corpus")
WORD = re.compile(rb"[A-Za-z$_][\w$:-]{2,}")


def main() -> None:
    """Run what the command line names, or all."""
    known = sorted(each.name for each in CORPUS.iterdir())
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("names", metavar="NAME", nargs="*", help=f"default: all of {', '.join(known)}")
    parser.add_argument("--seconds", type=int, default=60, help="time of each, s")
    given = parser.parse_args()
    if unknown := set(given.names) - set(known):
        parser.error(f"{', '.join(sorted(unknown))}: not one of {', '.join(known)}")
    FOUND.mkdir(parents=True, exist_ok=True)
    targets = guided_targets()
    targets.folder()  # goes when this process ends: libFuzzer leaves its own without cleaning up
    went_well = [run(name, targets.TARGETS[name], given.seconds) for name in given.names or known]
    sys.exit(0 if all(went_well) else 1)


def guided_targets() -> ModuleType:
    """The targets, with readers that tell the fuzzer their branches; kernels must stay as they were compiled."""
    kernels = [each.name for each in pkgutil.walk_packages(touchline.core.__path__, "touchline.core.")]
    guided = atheris.instrument_imports(include=GUIDING, exclude=kernels)
    with redirect_stderr(io.StringIO()), guided:
        return importlib.import_module("tests.fuzz.targets")


def run(name: str, target: Callable[[bytes], None], seconds: int) -> bool:
    """Run a fuzzer in a process of its own, and print how it went; return whether it found nothing."""
    begun_s, log = time.monotonic(), FOUND / f"{name}.log"
    process = os.fork()
    if not process:
        with log.open("wb") as output:
            os.dup2(output.fileno(), 1)
            os.dup2(output.fileno(), 2)
        fuzz(name, target, seconds)  # libFuzzer ends the process
    failed = os.waitpid(process, 0)[1] != 0
    tried = int((re.findall(r"^#(\d+)", log.read_text(errors="replace"), re.MULTILINE) or ["0"])[-1])
    told = f"FOUND something: see {log} and {FOUND / name}.crashes" if failed else "nothing found"
    print(f"{name}: {tried:,} inputs in {time.monotonic() - begun_s:.0f} s: {told}", flush=True)
    return not failed


def fuzz(name: str, target: Callable[[bytes], None], seconds: int) -> None:
    """Fuzz in this process."""

    def timed(data: bytes) -> None:
        begun_s = time.process_time()
        target(data)
        assert time.process_time() - begun_s <= MOST_S, "it takes too long"

    found, crashes, words = FOUND / name, FOUND / f"{name}.crashes", FOUND / f"{name}.words"
    for folder in (found, crashes):
        folder.mkdir(exist_ok=True)
    kept = [each.read_bytes() for each in (CORPUS / name).iterdir()]
    found_words = sorted({word.decode() for each in kept for word in WORD.findall(each)})
    words.write_text("".join(f'"{word}"\n' for word in found_words))
    for each in kept:  # what is loaded at the first use takes memory, which is not the input's
        target(each)
    most_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024 + MOST_MB
    limits = [f"-timeout={LONGEST_S}", f"-rss_limit_mb={most_mb}", f"-max_len={LONGEST_BYTES}"]
    told = [f"-max_total_time={seconds}", f"-artifact_prefix={crashes}/", f"-dict={words}", "-reload=0"]
    atheris.Setup([sys.argv[0], *limits, *told, str(found), str(CORPUS / name)], timed)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
