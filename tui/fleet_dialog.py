"""Dialog for an order to all robots."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.content import Content
from textual.widgets import Label, OptionList, Static
from textual.widgets.option_list import Option

from touchline.tui.dialogs import Dialog, DialogBox
from touchline.tui.fleet_orders import FLEET_ORDERS, FleetOrder, census, concerned
from touchline.tui.state import ConsoleState


class FleetDialog(Dialog[FleetOrder | None]):
    """Choose an order by its key, or by arrows and Enter; a confirmation follows."""

    NOTE = (("enter", "or the order's key"), ("esc", "cancel"))
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding(order.key, f"choose({order.name!r})", order.title) for order in FLEET_ORDERS
    ]

    def __init__(self, states: Mapping[str, ConsoleState]) -> None:
        """Create the dialog for these robots."""
        super().__init__()
        self._states = states

    def compose(self) -> ComposeResult:
        """Lay out the robots' states, and the number of robots for each order."""
        with DialogBox(id="dialog"):
            yield Label(f"An order to all {len(self._states)} robots", classes="title")
            yield Static(census(self._states))
            yield OptionList(*(self._option(order) for order in FLEET_ORDERS))

    def _option(self, order: FleetOrder) -> Option:
        count = len(concerned(order, self._states))
        parts = (f"{order.key:<6} ", "bold"), (f"{order.title:<8}", "bold")
        text = f"{count} of {len(self._states)}: {order.whom}"
        return Option(Content.assemble(*parts, text), id=order.name, disabled=not count)

    def on_mount(self) -> None:
        """Highlight the first order, the most harmless."""
        self.query_one(OptionList).focus()

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Choose an order by Enter or a click."""
        self.action_choose(str(event.option.id))

    def action_choose(self, name: str) -> None:
        """Return the order; one without recipients shows a message."""
        self.dismiss(next(order for order in FLEET_ORDERS if order.name == name))
