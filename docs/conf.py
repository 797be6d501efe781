"""Settings of the documentation's site, which `make docs` builds (Sphinx, MyST and furo)."""

import re
import shutil
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.util.logging import getLogger

import touchline
import touchline.gym
import touchline.plugins
from touchline.recordings.code_identity import code_digest

project = "Touchline"
version = touchline.__version__
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
root_doc = "README"
exclude_patterns = ["conf.py", "console_picture.py"]

html_theme = "furo"
html_title = f"Touchline {version}"
html_show_copyright = html_show_sphinx = html_show_sourcelink = False
html_copy_source = False

myst_heading_anchors = 4

nb_custom_formats = {".py": ["jupytext.reads", {"fmt": "py:percent"}]}
# What was executed counts until a cell or Touchline's code changes.
nb_execution_mode = "cache"
nb_execution_cache_path = str(Path(__file__).parents[1] / "build" / "notebooks" / code_digest())
nb_execution_raise_on_error = True
nb_execution_timeout = 600

default_role = "py:obj"
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented_params"
autodoc_typehints_format = "short"
napoleon_use_ivar = True
python_use_unqualified_type_names = True


def _adapt(app: Sphinx, page: str, source: list[str]) -> None:
    """Give a page what it has on the site only.

    The links of a README become the navigation, links to files outside of `docs/` downloads, and the pages of tutorials
    offer them as notebooks.
    """
    text = source[0].replace("](../../", "](path:../../")
    if Path(page).name == "README":
        parts = re.split(r"^#+ (.*)$", text, flags=re.M)[1:]
        for heading, part in zip(parts[::2], parts[1::2], strict=True):
            entries = "\n".join(re.findall(r"\]\(([\w/-]+(?:\.md|\.py))\)", part))
            text += f"\n```{{toctree}}\n:hidden:\n:caption: {heading.split(':')[0]}\n{entries}\n```\n"
    elif app.env.doc2path(page).suffix == ".py":
        text += f"\n# %% [markdown]\n# Download as a notebook: {{nb-download}}`{Path(page).name}.ipynb`\n"
    source[0] = text


def _hide_signature(app: Sphinx, kind: str, name: str, found: Any, *_: object) -> tuple[str, None] | None:
    """Leave out the arguments of classes that list them as attributes, or that users get from functions."""
    of_functions = is_dataclass(found) and getattr(found, "__module__", "").startswith("touchline.api.")
    return ("", None) if kind == "class" and (of_functions or issubclass(found, BaseModel)) else None


def _skip(app: Sphinx, kind: str, name: str, found: object, *_: object) -> bool | None:
    """Leave out the configuration of models, and the fields of named tuples, which their docstrings describe."""
    of_tuple = str(getattr(found, "__doc__", "")).startswith("Alias for field number")
    return True if of_tuple or name == "model_config" else None


def _keep_colon(app: Sphinx, kind: str, name: str, found: object, options: object, lines: list[str]) -> None:
    """Keep napoleon from taking the words before a colon for the type of an attribute."""
    if kind in ("attribute", "property") and lines:
        before, colon, after = lines[0].partition(": ")
        if colon:
            lines[:1] = [f"{before}:", after]


def _check_names(app: Sphinx, environment: BuildEnvironment) -> None:
    """Warn of public names that no page describes."""
    described = environment.domains.python_domain.objects
    for module in (touchline, touchline.gym, touchline.plugins):
        for name in module.__all__:
            if not {f"{module.__name__}.{name}", f"touchline.{name}"} & described.keys():
                getLogger(__name__).warning("%s.%s is missing in reference/python.md", module.__name__, name)


def _add_index(app: Sphinx, failure: Exception | None) -> None:
    """Make the first page the one that web servers show."""
    if failure is None and app.builder.format == "html":
        shutil.copy(app.outdir / "README.html", app.outdir / "index.html")


def setup(app: Sphinx) -> None:
    """Connect the functions above."""
    app.connect("source-read", _adapt)
    app.connect("autodoc-process-signature", _hide_signature)
    app.connect("autodoc-skip-member", _skip)
    app.connect("autodoc-process-docstring", _keep_colon, priority=100)
    app.connect("env-check-consistency", _check_names)
    app.connect("build-finished", _add_index)
