"""Dialog to choose a shipped template or a file."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar, NamedTuple

from textual import events
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.content import Content
from textual.widgets import Input, Label, OptionList, Static
from textual.widgets.option_list import Option

from touchline.schemas.catalogue import parse_template, shipped_templates, template_text
from touchline.schemas.errors import SpecError, TouchlineError
from touchline.schemas.plain_text import plain
from touchline.schemas.template import Template
from touchline.tui import format
from touchline.tui.dialogs import Dialog, DialogBox

Chosen = tuple[Template, str]
"""Template and its text."""
_STOP_KEY = "e"


def read_template(name_or_path: str) -> Chosen:
    """Read a shipped template by name, or a file.

    Raises:
        SpecError: There is no such template or file, or it is not valid.
    """
    text, source = template_text(_home(name_or_path))
    return parse_template(text, source), text


def _home(path: str) -> str:
    """Expand `~` and `~user` in a path, as a shell would; other paths and names are unchanged."""
    if not path.startswith("~"):
        return path
    try:
        return str(Path(path).expanduser())
    except RuntimeError:
        raise SpecError(path, "", "names a user without a home folder", "give the whole path") from None


class Shipped(NamedTuple):
    """Shipped template as a row of the list."""

    name: str
    title: str
    size: str

    def matches(self, words: str) -> bool:
        """True if all words are in the name or title."""
        text = f"{self.name} {self.title}".casefold()
        return all(word in text for word in words.casefold().split())


def size_of(template: Template) -> str:
    """Size of a template: lines and their length, areas and their size."""
    parts = []
    if template.segments or not template.areas:
        lines = "1 line" if len(template.segments) == 1 else f"{len(template.segments)} lines"
        parts.append(f"{lines}, {format.length(template.length_m)}")
    if template.areas:
        areas = "1 area" if len(template.areas) == 1 else f"{len(template.areas)} areas"
        holes = sum(len(area.holes) for area in template.areas)
        less = "" if not holes else ", 1 hole" if holes == 1 else f", {holes} holes"
        parts.append(f"{areas}, {template.area_m2:,.0f} m²{less}")
    return ", ".join(parts)


class TemplateDialog(Dialog[Chosen | None]):
    """Choose a shipped template, by arrows or by typing a part of its name, or give a file.

    Until something has been typed, `e` is the emergency stop, as everywhere; in the field it is a letter.
    """

    NOTE = (("enter", "choose"), ("esc", "cancel"), ("type", "to find"), ("tab", "list, field"))
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("up", "move(-1)", "Up", show=False),
        Binding("down", "move(1)", "Down", show=False),
        Binding("pageup", "move(-8)", "Page up", show=False),
        Binding("pagedown", "move(8)", "Page down", show=False),
    ]

    def __init__(self) -> None:
        """List the shipped templates."""
        super().__init__()
        self._shipped: list[Shipped] = []
        for name in shipped_templates():
            try:
                template, _ = read_template(name)
            except TouchlineError:
                continue
            self._shipped.append(Shipped(name, template.title, size_of(template)))

    def compose(self) -> ComposeResult:
        """Lay out the list, the field, and room for its error."""
        with DialogBox(id="dialog"):
            yield Label("Choose a template", classes="title")
            yield OptionList(id="templates")
            hint = "type a part of a name, or a file: path/to/template.json"
            yield Input(placeholder=hint, id="path", compact=True, select_on_focus=False)
            yield Static("", id="problem")

    def on_mount(self) -> None:
        """Show all templates."""
        self._list("")
        self.query_one(OptionList).focus()

    def _list(self, words: str) -> None:
        """Show matching templates; titles have a separate column, and yield to names and sizes."""
        found = [each for each in self._shipped if each.matches(words)]
        name_width, size_width = (max((len(each[column]) for each in self._shipped), default=0) for column in (0, 2))
        options = self.query_one(OptionList)
        options.clear_options()
        for each in found:
            parts = (f"{each.name:<{name_width}}  ", "bold"), (f"{each.size:<{size_width}}  ", ""), each.title
            options.add_option(Option(Content.assemble(*parts), id=each.name))
        options.highlighted = 0 if found else None

    def on_key(self, event: events.Key) -> None:
        """Pass keys typed in the list to the field, also before it has the focus."""
        field = self.query_one(Input)
        if field.has_focus or event.character is None or not event.is_printable:
            return
        if event.key == _STOP_KEY and not field.value:
            return
        event.stop()
        event.prevent_default()
        field.value += event.character
        field.cursor_position = len(field.value)
        field.focus()

    def on_input_changed(self, event: Input.Changed) -> None:
        """Show matching templates; a path matches none."""
        self._list(event.value)
        self.query_one("#problem", Static).update("")

    def action_move(self, steps: int) -> None:
        """Move the highlight while the field has the focus."""
        options = self.query_one(OptionList)
        if options.option_count:
            options.highlighted = min(max((options.highlighted or 0) + steps, 0), options.option_count - 1)

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Choose a shipped template."""
        self._take(str(event.option.id))

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Choose the highlighted template, or else a file."""
        options = self.query_one(OptionList)
        if options.highlighted is not None:
            self._take(str(options.get_option_at_index(options.highlighted).id))
        elif event.value.strip():
            self._take(event.value.strip())

    def _take(self, name_or_path: str) -> None:
        try:
            chosen = read_template(name_or_path)
        except (TouchlineError, OSError) as error:
            self.query_one("#problem", Static).update(Content(plain(str(error))))
        else:
            self.dismiss(chosen)
