"""Packages that only some features need, which are not installed with Touchline."""

from importlib.util import find_spec
from typing import Final

from touchline.schemas.errors import TouchlineError

#: What `pip install` is given, by the module that is imported.
_PACKAGES: Final = {
    "distributed": "'distributed>=2025.1'",
    "foxglove": "'foxglove-sdk>=0.30,<0.31'",
    "gymnasium": "'gymnasium>=1.0'",
    "pandas": "'pandas>=2.2'",
    "polars": "'polars>=1'",
    "pyarrow": "'pyarrow>=20'",
    "touchline_research": "touchline-research",
    "pyubx2": "'pyubx2>=1.2,<2'",
}


def require(module: str, feature: str) -> None:
    """Refuse a feature whose package is missing, before any work is done.

    Args:
        module: Of the package.
        feature: Its user-facing name, such as `--parquet`.

    Raises:
        TouchlineError: The package is not installed.
    """
    if find_spec(module) is None:
        raise TouchlineError(f"{feature} needs a package that is not installed: pip install {_PACKAGES[module]}")
