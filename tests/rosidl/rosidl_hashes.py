"""Type hashes by ROS 2's own code generator, as JSON on standard output; imports nothing of ours.

Run by `make ros2-hashes` with an interpreter that has ROS 2's wheels:

    python tests/rosidl/rosidl_hashes.py DEFINITIONS [INSTALL]

DEFINITIONS is what `touchline topics --msg-dir` has written. Each of its types goes through rosidl_adapter (.msg to
.idl) and rosidl_generator_type_description. What ROS 2's own packages say of their types, and with INSTALL what colcon
has built of ours, has to be the same; a difference ends it with exit code 1.
"""

import json
import sys
import sysconfig
import tempfile
from contextlib import redirect_stdout
from graphlib import TopologicalSorter
from importlib.metadata import version
from io import StringIO
from pathlib import Path

from rosidl_adapter.msg import convert_msg_to_idl
from rosidl_adapter.srv import convert_srv_to_idl
from rosidl_generator_type_description import generate_type_hash

CONVERTERS = {"msg": convert_msg_to_idl, "srv": convert_srv_to_idl}
GENERATORS = ("ros-rosidl-adapter", "ros-rosidl-generator-type-description", "ros-common-interfaces")


def generate(definitions: Path, package: str, out: Path) -> None:
    """Write the hashes of a package's types; those of the packages that it needs are in ``out`` already."""
    idl = []
    for path in sorted(definitions.glob(f"{package}/*/*")):
        if path.parent.name in CONVERTERS:
            target = out / package / path.parent.name
            inner = path.relative_to(definitions / package)
            CONVERTERS[path.parent.name](definitions / package, package, inner, target)
            idl.append(f"{out / package}:{inner.with_suffix('.idl')}")
    arguments = out / f"{package}.json"
    told = {
        "package_name": package,
        "output_dir": str(out / package),
        "idl_tuples": idl,
        "include_paths": [f"{other.name}:{other}" for other in out.iterdir() if other.is_dir()],
    }
    arguments.write_text(json.dumps(told))
    generate_type_hash(str(arguments))


def needs(definitions: Path, package: str) -> set[str]:
    """The packages whose types the definitions of a package, and the events of its services, have."""
    found = {"service_msgs"} if any(definitions.glob(f"{package}/srv/*")) else set()
    for path in definitions.glob(f"{package}/*/*"):
        if path.parent.name in CONVERTERS:
            lines = path.read_text().splitlines()
            found |= {line.split("/")[0] for line in lines if "/" in line.split("#")[0].split(" ")[0]}
    return found - {package}


def hashes(folder: Path) -> dict[str, str]:
    """Those of all types below a folder of packages."""
    found = {}
    for path in folder.glob("*/*/*.json"):
        if path.parent.name in CONVERTERS:
            found |= {each["type_name"]: each["hash_string"] for each in json.loads(path.read_text())["type_hashes"]}
    return found


def main() -> None:
    """Generate, compare and print."""
    definitions, *install = map(Path, sys.argv[1:])
    packages = {path.name: needs(definitions, path.name) for path in definitions.iterdir() if path.is_dir()}
    with tempfile.TemporaryDirectory() as scratch, redirect_stdout(StringIO()):  # the adapter tells of every file
        for package in TopologicalSorter(packages).static_order():
            generate(definitions, package, Path(scratch))
        ours = hashes(Path(scratch))
    for folder in (
        Path(sysconfig.get_path("data"), "share"),
        *(path for each in install for path in each.glob("*/share")),
    ):
        said = hashes(folder)
        if differing := sorted(name for name in ours.keys() & said.keys() if ours[name] != said[name]):
            sys.exit(f"other hashes than in {folder}: {', '.join(differing)}")
        sys.stderr.write(f"{folder}: the same hashes of {len(ours.keys() & said.keys())} types\n")
    kept = {name: value for name, value in sorted(ours.items()) if not name.endswith("_Event")}
    by = {"distribution": "jazzy", **{name: version(name) for name in GENERATORS}}
    print(json.dumps({"by": by, "hashes": kept}, indent=1))  # noqa: T201


if __name__ == "__main__":
    main()
