"""The folders of the repository as one package, `touchline`; everything else is said in pyproject.toml.

`research/` is a distribution of its own. A wheel has the code of kernels in it, if `make wheel` builds it, and is then
for one kind of processor.
"""

import shutil
import subprocess
from pathlib import Path

from setuptools import Distribution, find_packages, setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_py import build_py

BESIDE = ("schemas", "services", "tui")
FOLDERS = {"touchline": "src/touchline", **{f"touchline.{name}": name for name in BESIDE}}
PACKAGES = [
    each for package, at in FOLDERS.items() for each in (package, *(f"{package}.{name}" for name in find_packages(at)))
]
KERNELS = sorted(Path("build/kernels").glob("kernels.*"))


class WithKernels(build_py):
    """Adds the code of kernels, and the commit that it was built from."""

    def run(self) -> None:
        super().run()
        if not self.editable_mode:
            command = ["git", "describe", "--always", "--dirty", "--exclude=*", "--abbrev=40"]
            try:
                made = subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()
            except OSError:
                made = ""
            (Path(self.build_lib) / "touchline" / "_build.py").write_text(f"COMMIT = {made!r}\n", encoding="utf-8")
        if not self.editable_mode and KERNELS:
            folder = Path(self.build_lib) / "touchline" / "core" / "compiled"
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir(parents=True)
            for code in KERNELS:
                shutil.copy(code, folder)


class ForProcessor(bdist_wheel):
    """Names the kind of processor, but no version of Python."""

    def get_tag(self) -> tuple[str, str, str]:
        return "py3", "none", super().get_tag()[2]


class WithCode(Distribution):
    """Is for one kind of processor as soon as it has code for that."""

    def has_ext_modules(self) -> bool:
        return bool(KERNELS)


setup(
    package_dir=FOLDERS,
    packages=PACKAGES,
    distclass=WithCode,
    cmdclass={"build_py": WithKernels, "bdist_wheel": ForProcessor},
)
