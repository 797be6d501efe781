"""Writes deploy/requirements.txt: `make lock`.

It has the packages of `touchline[standard]` in the versions of constraints.txt, with the hashes of the wheels that pip
chooses for these Pythons and processors. It takes Python 3.11: pip goes by the running Python's needs, and 3.14 needs
fewer packages.
"""

import json
import subprocess
import sys
import tomllib
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PYTHONS = ("3.11", "3.12", "3.13")
PROCESSORS = ("x86_64", "aarch64")
#: Of glibc; what pip itself would allow on a machine that has the newest of them.
GLIBC = ("2_28", "2_27", "2_26", "2_24", "2_17")
HEAD = """\
# Packages of touchline[standard] with the hashes of their wheels, made by `make lock`: Linux with glibc 2.28 or newer,
# x86-64 and 64-bit ARM, Python 3.11 to 3.13. docs/reference/supply-chain.md tells how to install by it.
"""


def wanted() -> list[str]:
    """Requirements of `touchline[standard]`, others than itself."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    [own] = extras["standard"]
    names = own.partition("[")[2].rstrip("]").split(",")
    return [*project["dependencies"], *(each for name in names for each in extras[name])]


def chosen(python: str, processor: str) -> dict[str, str]:
    """Hash of the wheel of each package, by its name and version as in constraints.txt."""
    platforms = [f"--platform=manylinux_{version}_{processor}" for version in GLIBC]
    platforms += [f"--platform=manylinux2014_{processor}", f"--platform=linux_{processor}"]
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--dry-run"]
    command += ["--ignore-installed", "--only-binary=:all:", "--target=none", f"--python-version={python}", *platforms]
    command += ["--constraint", str(ROOT / "constraints.txt"), "--report=-", *wanted()]
    report = json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout)
    return {
        f"{each['metadata']['name'].lower().replace('_', '-')}=={each['metadata']['version']}": each["download_info"][
            "archive_info"
        ]["hashes"]["sha256"]
        for each in report["install"]
    }


def main() -> None:
    """Write the file."""
    hashes: defaultdict[str, set[str]] = defaultdict(set)
    for processor in PROCESSORS:
        for python in PYTHONS:
            for package, digest in chosen(python, processor).items():
                hashes[package].add(digest)
    lines = [
        " \\\n".join([package, *(f"    --hash=sha256:{digest}" for digest in sorted(digests))])
        for package, digests in sorted(hashes.items())
    ]
    (ROOT / "deploy" / "requirements.txt").write_text(HEAD + "\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
