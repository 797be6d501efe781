"""The shipped message packages are such that colcon can build them: complete, and named by ROS's rules."""

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from touchline.schemas.cdr import definition_files

ROOT = Path(__file__).resolve().parents[2] / "schemas" / "msg"
PACKAGES = sorted(path.name for path in ROOT.iterdir() if path.is_dir())
FIELD = re.compile(r"(?!.*__)(?!.*_$)[a-z][a-z0-9_]*")
CONSTANT = re.compile(r"[A-Z]([A-Z0-9_]?[A-Z0-9]+)*")
TYPE = re.compile(r"[A-Z][A-Za-z0-9]*")


def definitions(package):
    return sorted(path for path in (ROOT / package).glob("*/*") if path.suffix in (".msg", ".srv"))


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_builds_all_of_its_files_and_names_what_it_needs(package):
    files = definitions(package)
    needed = {match for path in files for match in re.findall(r"(?m)^(\w+)/\w+", path.read_text())} - {package}
    cmake = (ROOT / package / "CMakeLists.txt").read_text()
    assert re.findall(r'"(.+)"', cmake) == [str(path.relative_to(ROOT / package)) for path in files]
    assert set(re.findall(r"find_package\((\w+)", cmake)) == needed | {"ament_cmake", "rosidl_default_generators"}
    assert set(re.findall(r"DEPENDENCIES (.*)", cmake)[0].split()) == needed
    manifest = ET.parse(ROOT / package / "package.xml").getroot()
    assert manifest.findtext("name") == package
    assert {entry.text for entry in manifest.findall("depend")} == needed


def test_every_name_keeps_the_rules_of_ros():
    for name, text in definition_files():
        assert TYPE.fullmatch(name.rsplit("/", 1)[1].removesuffix("_Request").removesuffix("_Response")), name
        for line in re.sub(r"#.*", "", text).splitlines():
            if line.strip() and "=" in line.replace("<=", ""):
                assert CONSTANT.fullmatch(line.split("=")[0].split()[1]), line
            elif line.strip():
                assert FIELD.fullmatch(line.split()[1]), line
