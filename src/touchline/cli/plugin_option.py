"""Option that names a plug-in; its help and choices are read from the registry when the command is built."""

from typing import Any

import typer
from typer.models import OptionInfo

from touchline.schemas.plugins import Registry, UnknownPlugin


class PluginOption(OptionInfo):
    """Option that takes the name of a plug-in of one registry, and lists them all in its help.

    Args:
        option: Name of the option, with its dashes.
        registry: Registry of the plug-ins.
        metavar: Placeholder of the value in the help.
        about: Beginning of the help: the purpose of these plug-ins.
        default: Default as the help shows it; "": the registry's first one.
        also: A second registry whose names are accepted.
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
        """Purpose, and each plug-in with its summary, the default first."""
        listed = "; ".join(f"{name}: {summary}" for name, summary in self._registry.summaries().items())
        return f"{self._about}. {listed}. Default: {self._default or self._registry.default}."

    @help.setter
    def help(self, text: str | None) -> None:
        """Ignored: the help is always made from the registry."""
