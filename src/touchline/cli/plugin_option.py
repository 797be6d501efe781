"""The option that names a plug-in: its help and what it takes are what is registered when the command is built."""

from typing import Any

import typer
from typer.models import OptionInfo

from touchline.schemas.plugins import Registry, UnknownPlugin


class PluginOption(OptionInfo):
    """Takes the name of a plug-in of one registry, and lists them all in its help.

    Args:
        option: As written on the command line.
        registry: Of the plug-ins.
        metavar: Stands for the name in the help.
        about: What these plug-ins do, as the beginning of the help.
        default: What is taken if the option is left out, as the help says it; "": the registry's first one.
        also: Names of this one are taken, too.
    """

    def __init__(
        self,
        option: str,
        registry: Registry[Any],
        metavar: str,
        about: str,
        default: str = "",
        also: Registry[Any] | None = None,
    ) -> None:
        def known(name: str | None) -> str | None:
            if name is None or (also and name in also.names()):
                return name
            try:
                return registry.known(name)
            except UnknownPlugin as error:
                raise typer.BadParameter(f"is {name!r}; {error.remedy}") from error

        self._registry, self._about, self._default = registry, about, default
        super().__init__(default=..., param_decls=(option,), metavar=metavar, callback=known, show_default=False)

    @property
    def help(self) -> str:
        """What they do, and each with its summary; the default comes first."""
        listed = "; ".join(f"{name}: {summary}" for name, summary in self._registry.summaries().items())
        return f"{self._about}. {listed}. Default: {self._default or self._registry.default}."

    @help.setter
    def help(self, text: str | None) -> None:
        """Nothing is kept: it is made anew from what is registered."""
