"""Dialogs of the console: base classes, plan options, and yes-no questions."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Iterator
from typing import ClassVar, Final, TypeVar

import numpy as np
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Grid, Horizontal, VerticalScroll
from textual.screen import ModalScreen
from textual.widget import Widget
from textual.widgets import Button, Checkbox, Input, Label, RadioButton, RadioSet, Static

from touchline.schemas.messages.plan_messages import PlanOptions
from touchline.schemas.plugins import AREA_METHODS, METHODS
from touchline.schemas.vehicles import Vehicle
from touchline.tui import theme
from touchline.tui.stop_screen import add_stop

Result = TypeVar("Result")
_DEFAULTS: Final = PlanOptions()
_MOST_DEG: Final = 360.0
_WHOLE_PCT: Final = 100.0


class DialogBox(VerticalScroll, can_focus=False):
    """Box of a dialog, which scrolls to the focus."""


class Dialog(ModalScreen[Result]):
    """Box in the middle of the screen; Esc closes it, and the emergency stop works in it, by key and by click.

    Attributes:
        NOTE: Keys and their meaning, for the row of the emergency stop, the most important first.
    """

    NOTE: ClassVar[tuple[tuple[str, str], ...]] = (("esc", "cancel"),)
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "dismiss(None)", "Cancel"),
        Binding("e", "app.estop", "E-STOP", show=False),
    ]

    def on_mount(self) -> None:
        """Add the row of the orders and the emergency stop; dialogs extend this by their own `on_mount`."""
        add_stop(self, self.NOTE)


class FormDialog(Dialog[Result]):
    """Dialog of fields, with `#ok` to accept them, and `#problem` for an error in one."""

    def on_button_pressed(self, event: Button.Pressed) -> None:
        """Accept or cancel."""
        if event.button.id == "ok":
            self.accept()
        else:
            self.dismiss(None)

    def on_input_submitted(self) -> None:
        """Accept on Enter in a field."""
        self.accept()

    @abstractmethod
    def accept(self) -> None:
        """Return the values of the fields, or show what is wrong."""

    def written_number(self, field: str, problem: str) -> float | None:
        """Number in a field, 0 if it is empty; None, with `problem` shown, if it is not a number above 0."""
        text = self.query_one(f"#{field}", Input).value.strip()
        try:
            value = float(text) if text else 0.0
        except ValueError:
            value = math.nan
        if not 0.0 <= value < math.inf or (text and not value):
            self.refuse(field, problem)
            return None
        return value

    def refuse(self, field: str, problem: str) -> None:
        """Show the problem of a field."""
        self.query_one("#problem", Static).update(problem)
        self.query_one(f"#{field}", Input).focus()


class Choice(RadioButton):
    """Radio button whose mark, not only its colour, shows whether it is pressed."""

    @property
    def BUTTON_INNER(self) -> str:  # type: ignore[override]  # noqa: N802
        """Mark of the button."""
        return "●" if self.value else "○"


class Tick(Checkbox):
    """Checkbox whose mark shows whether it is ticked."""

    @property
    def BUTTON_INNER(self) -> str:  # type: ignore[override]  # noqa: N802
        """Mark of the button."""
        return "■" if self.value else "□"


class PlanDialog(FormDialog[PlanOptions | None]):
    """Dialog of plan options; empty fields take the vehicle's defaults."""

    NOTE = (("enter", "plan"), ("esc", "cancel"), ("tab", "next field"))

    FIELDS: ClassVar[dict[str, tuple[str, str]]] = {
        "paint_speed_mps": ("working speed  m/s", "{tool.work_speed_mps:g}"),
        "transit_speed_mps": ("driving speed  m/s", "{drive.transit_speed_mps:g}"),
        "kappa_max_1pm": ("curvature ≤  1/m", "{drive.default_kappa_max_1pm:g}"),
        "sigma_max_1pm2": ("sharpness ≤  1/m²", "{drive.default_sigma_max_1pm2:g}"),
    }
    """Option → (label, the vehicle's default, unless the method has another)."""
    AREA_FIELDS: ClassVar[dict[str, tuple[str, str]]] = {
        "overlap_m": ("lanes overlap ≥  m", "0.03"),
        "margin_m": ("body off edges ≥  m", "0.05"),
        "laps": ("laps along edges", "as needed"),
        "swath_angle_deg": ("lanes' direction  °", "which suits"),
        "coverage_pct": ("touch up until  %", "what is cheap"),
    }
    """The same for tools that cover areas, with the defaults of `PlanOptions`."""
    TICKS: ClassVar[dict[str, str]] = {
        "order": "order as given",
        "forward_only": "forward only",
        "return_to_start": "end at the start",
    }
    """Boolean options."""

    def __init__(self, options: PlanOptions, vehicle: Vehicle, *, areas: bool = False) -> None:
        """Start from the options used last; `areas` adds the fields for covering."""
        super().__init__()
        self._options, self._vehicle = options, vehicle
        self._area_methods = AREA_METHODS.summaries_for(covers=vehicle.tool.covers) if areas else {}
        self._area_fields = self.AREA_FIELDS if areas and vehicle.tool.covers else {}

    def compose(self) -> ComposeResult:
        """Lay out method, limits and buttons."""
        with DialogBox(id="dialog"):
            yield Label("Plan the path", classes="title")
            chosen = self._options.method or METHODS.default
            with RadioSet(id="method"):
                yield from choices(METHODS.summaries(), chosen)
            if self._area_methods:
                yield Label("Areas")
                with RadioSet(id="area-method"):
                    known = self._options.area_method in self._area_methods
                    area_method = self._options.area_method if known else next(iter(self._area_methods))
                    yield from choices(self._area_methods, area_method)
            with Grid(id="limits"):
                for field, (label, _) in self.FIELDS.items():
                    value = getattr(self._options, field)
                    written = f"{value:g}" if value else ""
                    yield from number_field(field, label, written, self._left_empty(field, chosen))
                for field, (label, empty) in self._area_fields.items():
                    yield from number_field(field, label, _written(self._options, field), empty)
            with Horizontal(id="ticks"):
                for field, label in self.TICKS.items():
                    on = getattr(self._options, field)
                    yield Tick(label, on == "given" if field == "order" else on, id=field, compact=True)
            yield Static("", id="problem")
            with Horizontal(id="buttons"):
                yield Button("Plan", variant="primary", id="ok")
                yield Button("Cancel", id="cancel")

    def on_mount(self) -> None:
        """Focus so that Enter plans as before."""
        self.query_one("#ok").focus()

    @on(RadioSet.Changed, "#method")
    def say_empty(self, event: RadioSet.Changed) -> None:
        """Show the defaults of empty fields for the method."""
        for field in self.FIELDS:
            self.query_one(f"#{field}", Input).placeholder = self._left_empty(field, str(event.pressed.name))

    def _left_empty(self, field: str, method: str) -> str:
        """Default of an empty field."""
        return METHODS.empty(method, field) or self.FIELDS[field][1].format_map(vars(self._vehicle))

    def accept(self) -> None:
        """Return the options."""
        values: dict[str, float] = {}
        for field, (label, _) in self.FIELDS.items():
            value = self.written_number(field, f"{label}: give a number above 0, or nothing for the default")
            if value is None:
                return
            values[field] = value
        covering: dict[str, object] = {}
        for field, (label, _) in self._area_fields.items():
            text = self.query_one(f"#{field}", Input).value.strip()
            try:
                covering[field] = _read(field, text)
            except ValueError as error:
                self.refuse(field, f"{label}: give {error}, or nothing for the default")
                return
        method = pressed(self, "#method")
        area_method = pressed(self, "#area-method") if self._area_methods else self._options.area_method
        forward, back = (self.query_one(f"#{field}", Tick).value for field in ("forward_only", "return_to_start"))
        order = "given" if self.query_one("#order", Tick).value else ""
        ticks = {"order": order, "forward_only": forward, "return_to_start": back}
        chosen = {"method": method, "area_method": area_method, **ticks, **values, **covering}
        self.dismiss(self._options.model_copy(update=chosen))


def pressed(dialog: Widget, radio_set: str) -> str:
    """Name of the pressed button of a set."""
    button = dialog.query_one(radio_set, RadioSet).pressed_button
    return str(button.name) if button else ""


def number_field(name: str, label: str, value: str, empty: str) -> Iterator[Widget]:
    """Create a label and a field for a number."""
    yield Label(label)
    yield Input(value, placeholder=empty, type="number", id=name, compact=True)


def _written(options: PlanOptions, field: str) -> str:
    """Value of the options for one of `PlanDialog.AREA_FIELDS`, "" if it is the default."""
    if field == "swath_angle_deg":
        return "".join(f"{angle:g}" for angle in options.swath_angle_deg.tolist())
    value = getattr(options, field)
    return "" if value == getattr(_DEFAULTS, field) else f"{value:g}"


def _read(field: str, text: str) -> object:
    """Parse the value of one of `PlanDialog.AREA_FIELDS`.

    Raises:
        ValueError: The text is not valid; the error says what would be.
    """
    if not text:
        return getattr(_DEFAULTS, field)
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if field == "swath_angle_deg":
        if not abs(value) <= _MOST_DEG:
            raise ValueError(f"an angle from -{_MOST_DEG:g} to {_MOST_DEG:g}")
        return np.array([value])
    if field == "laps":
        if not (value >= 0.0 and value == math.floor(value) < math.inf):
            raise ValueError("a whole number from 0 on")
        return int(value)
    if field == "coverage_pct":
        if not 0.0 < value <= _WHOLE_PCT:
            raise ValueError("a number above 0, up to 100")
        return value
    if not 0.0 <= value < math.inf:
        raise ValueError("a number from 0 on")
    return value


def choices(summaries: dict[str, str], chosen: str) -> Iterator[Choice]:
    """Create a button for every plug-in."""
    for name, text in summaries.items():
        yield Choice(f"{name}  [{theme.MUTED}]{text}[/]", value=name == chosen, name=name)


class ConfirmDialog(Dialog[bool | None]):
    """Question that is answered with y or n."""

    NOTE = (("y", "yes"), ("n, enter, esc", "no"))

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("y", "dismiss(True)", "Yes"),
        Binding("n", "dismiss(False)", "No"),
    ]

    def __init__(self, question: str, text: str, yes: str, void: Callable[[], str] = lambda: "") -> None:
        """Create the question; `yes` labels the button, `void` returns why the question is void, "" while it is not."""
        super().__init__()
        self.question, self.void = question, void
        self._text, self._yes = text, yes

    def compose(self) -> ComposeResult:
        """Lay out question, explanation and buttons."""
        with DialogBox(id="dialog"):
            yield Label(self.question, classes="title")
            yield Static(self._text)
            with Horizontal(id="buttons"):
                yield Button(f"{self._yes} (y)", variant="error", id="yes")
                yield Button("No (n)", variant="primary", id="no")

    def on_mount(self) -> None:
        """Focus the harmless answer."""
        self.query_one("#no").focus()

    def on_button_pressed(self, event: Button.Pressed) -> None:
        """Return the answer."""
        self.dismiss(event.button.id == "yes")
