"""The folders of the repository as one package, `touchline`; everything else is said in pyproject.toml.

`research/` is a distribution of its own.
"""

from setuptools import find_packages, setup

BESIDE = ("schemas", "services", "tui")
FOLDERS = {"touchline": "src/touchline", **{f"touchline.{name}": name for name in BESIDE}}
PACKAGES = [
    each for package, at in FOLDERS.items() for each in (package, *(f"{package}.{name}" for name in find_packages(at)))
]
setup(package_dir=FOLDERS, packages=PACKAGES)
