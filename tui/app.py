"""The console itself: it polls the link, reduces what came in, shows it, and hands keys to the operator's orders."""

from __future__ import annotations

import math
import secrets
import time
from collections.abc import Callable, Iterable
from typing import ClassVar

from textual import events
from textual.app import App, ComposeResult, SystemCommand
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.driver import Driver
from textual.drivers.linux_driver import LinuxDriver
from textual.filter import Monochrome
from textual.message import Message
from textual.screen import Screen

from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages.touchline import PlanOptions, TraversalStatus
from touchline.schemas.plain_text import plain
from touchline.tui import palette, supply_check, theme
from touchline.tui.autostart import AutoStart
from touchline.tui.colors import Grey
from touchline.tui.dialogs import Chosen, ConfirmDialog, KeysDialog, PlanDialog, TemplateDialog, read_template
from touchline.tui.dispatch import Dispatcher
from touchline.tui.driver import SturdyDriver
from touchline.tui.event_log import ERROR, INFO, WARN
from touchline.tui.header import HeaderBar
from touchline.tui.key_bar import KeyBar
from touchline.tui.lines_view import SegmentsTable
from touchline.tui.log_view import LogView
from touchline.tui.map_view import MapView
from touchline.tui.operator import Operator
from touchline.tui.order_book import Phase
from touchline.tui.orders import OrderOutcome, Tried
from touchline.tui.panels import ServicesPanel, StatusPanel
from touchline.tui.protocol import Link
from touchline.tui.signal_bar import SignalBar
from touchline.tui.state import ConsoleState
from touchline.tui.stop_screen import Palette

POLL_HZ = 12
PAINT_RETRY_S = 1.0
LONGEST_TICK_S = 0.25
"""What goes on longer between two ticks is the console's own absence: it makes nobody else silent."""


class OrderNews(Message):
    """An order was sent again or came back; posted from its thread."""

    def __init__(self, news: Tried | OrderOutcome) -> None:
        """With what became of it."""
        super().__init__()
        self.news = news


class ConsoleApp(App[None]):
    """An operator's console over a link."""

    TITLE = "Touchline"
    CSS_PATH = "console.tcss"
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (100, "-normal"), (160, "-wide")]  # noqa: RUF012, as in the base class
    VERTICAL_BREAKPOINTS = [(0, "-low"), (34, "-high")]  # noqa: RUF012, as in the base class
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+e", "estop", "Emergency stop", priority=True),
        Binding("e", "estop", "Emergency stop"),
        Binding("t", "template", "Template"),
        Binding("p", "plan", "Plan"),
        Binding("l", "load", "Load"),
        Binding("s", "command('start')", "Start"),
        Binding("space", "command('pause')", "Pause"),
        Binding("g", "command('resume')", "Go on"),
        Binding("a", "abort", "Abort"),
        Binding("r", "command('reset')", "Reset"),
        Binding("u", "command('refill')", "Tank filled up"),
        Binding("b", "command('battery')", "Battery replaced"),
        Binding("right_square_bracket,full_stop", "speed(1)", "Faster"),
        Binding("left_square_bracket,comma", "speed(-1)", "Slower"),
        Binding("f", "follow", "Follow the robot"),
        Binding("0,home", "fit", "Show the whole job"),
        Binding("plus,equals_sign", "zoom(1)", "Zoom in"),
        Binding("minus,underscore", "zoom(-1)", "Zoom out"),
        Binding("question_mark", "keys", "Keys"),
        Binding("q", "quit", "Quit"),
    ]

    def __init__(
        self,
        link: Link,
        autostart: AutoStart | None = None,
        *,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Show what comes over `link`; `clock` is used to notice silence and to pace repeats."""
        super().__init__()
        self.state = ConsoleState()
        dispatcher = Dispatcher(link, lambda news: self.post_message(OrderNews(news)))
        self.operator = Operator(self.state, dispatcher, self._say, secrets.token_hex(4))
        self._link = link
        self._autostart = autostart or AutoStart()
        self._clock = clock
        self._ticked_s = clock()
        self._stop_typed_s = -math.inf
        self._paint_due_s = 0.0
        self._header, self._signals, self._keys = HeaderBar(), SignalBar(), KeyBar()
        self._map, self._log_view = MapView(), LogView()
        self._status, self._services, self._segments = StatusPanel("Status"), ServicesPanel("Services"), SegmentsTable()
        self._filters = [Grey() if isinstance(filter, Monochrome) else filter for filter in self._filters]
        self.register_theme(theme.THEME)
        self.theme = theme.THEME.name

    def compose(self) -> ComposeResult:
        """Header, orders and alerts, map and log on the left, panels on the right, keys."""
        yield self._header
        yield self._signals
        with Horizontal(id="body"):
            with Vertical(id="left"):
                yield self._map
                yield self._log_view
            with Vertical(id="right"):
                yield self._status
                yield self._services
                yield self._segments
        yield self._keys

    def on_mount(self) -> None:
        """Begin to poll."""
        self._map.focus()
        if self._autostart.template is not None:
            self._open_template(self._autostart.template)
        self.set_interval(1 / POLL_HZ, self.tick)
        self.call_after_refresh(self.tick)

    # -- what comes in -----------------------------------------------------------------------------------------------

    def tick(self) -> None:
        """Take what came in, give what orders are due, and show how things are."""
        now, since = self._clock(), self._ticked_s
        self._ticked_s = now
        self.state.now_s += min(max(now - since, 0.0), LONGEST_TICK_S)
        for event in self._link.poll():
            self.state.apply(event, self.state.now_s)
        self.operator.heed_status()
        if self.state.paint.needs_fetch and self.state.robot_alive and now >= self._paint_due_s:
            self._paint_due_s = now + PAINT_RETRY_S
            self._link.fetch_paint()
        self._go_on_starting()
        self.show_state()

    def show_state(self) -> None:
        """Bring every panel up to date; each redraws only what changed."""
        if not self._map.is_attached:  # an answer may still come in while the console is being taken down
            return
        state = self.state
        self.screen_stack[0].set_class(state.traversal == TraversalStatus.ESTOPPED, "-stopped-robot")
        for panel in (self._header, self._map, self._status, self._services, self._segments, self._keys):
            panel.show(state)
        self._log_view.show(state.log)
        self._show_signals()

    def _show_signals(self) -> None:
        """Bring the row of the orders up to date, on dialogs, too."""
        if self._signals.is_attached:
            for screen in self.screen_stack:
                for bar in screen.query(SignalBar):
                    bar.show(self.state)

    def on_order_news(self, event: OrderNews) -> None:
        """Take in what became of an order; the next tick shows the rest of what that changed."""
        if isinstance(event.news, Tried):
            self.operator.tried(event.news)
        else:
            ok = self.operator.done(event.news)
            self._autostart.done(event.news.order.name, ok)
            self._go_on_starting()
        self._show_signals()

    def _go_on_starting(self) -> None:
        match self._autostart.due(self.state):
            case "plan":
                if self.operator.may_prepare("Start", needs_template=True):
                    self.operator.plan(self.operator.options)
                else:
                    self._autostart.stop()
            case "load":
                self.operator.load()
            case "speed" if self._autostart.speed is not None:
                self.operator.set_speed(self._autostart.speed)
            case "start":
                for shortage in supply_check.of_job(self.state).shortages:
                    self.state.note(WARN, "console", f"the job {shortage}")
                self.operator.command("start")

    def _say(self, severity: int, text: str) -> None:
        """Tell the operator: in the row of the orders and in the log. There are no toasts, which would cover things."""
        text = plain(text)
        self.state.note(severity, "console", text)
        self.state.orders.say(severity, text, self.state.now_s)

    # -- keys --------------------------------------------------------------------------------------------------------

    def action_command(self, name: str) -> None:
        """An order without arguments; asks before a start for which tank or battery will not last."""
        shortages = supply_check.of_job(self.state).shortages
        if name != "start" or not shortages or not self.state.path_loaded or self.state.busy:
            self.operator.command(name)
            self._show_signals()
            return

        def answered(yes: bool | None) -> None:
            if yes:
                self.operator.command(name)

        text = "\n".join(f"The job {shortage}." for shortage in shortages)
        note = "The robot stops on the line when it runs out, and goes on when it is told to resume."
        self.push_screen(ConfirmDialog("Start all the same?", f"{text}\n{note}", "Start"), answered)

    @property
    def breakdown(self) -> Exception | None:
        """The error that ended the console, if one has."""
        return self._exception

    def _print_error_renderables(self) -> None:
        """Whoever runs the console tells of its breakdown in one line; pages of traceback are for ``TEXTUAL=debug``."""
        if "debug" not in self.features:
            self._exit_renderables.clear()
        super()._print_error_renderables()

    def get_driver_class(self) -> type[Driver]:
        """The terminal's; one of another kind, such as for a browser, is left as it is."""
        usual = super().get_driver_class()
        return SturdyDriver if usual is LinuxDriver else usual

    def stop_at_once(self, typed_s: float) -> None:
        """Stop the robot, from the thread that reads the keys; those typed before are of no use any more."""
        self._stop_typed_s = typed_s
        self.operator.stop()

    async def on_event(self, event: events.Event) -> None:
        """Leave out keys that were typed before an emergency stop and come after it: a reset may be among them."""
        if isinstance(event, events.Key) and event.time < self._stop_typed_s:
            return
        await super().on_event(event)

    def action_estop(self) -> None:
        """Stop the robot, whatever else is going on."""
        self.operator.stop()
        self._autostart.stop()
        self._show_signals()

    def action_command_palette(self) -> None:
        """Every command by name."""
        if not isinstance(self.screen, Palette):
            self.push_screen(Palette(id="--command-palette"))

    def action_help_quit(self) -> None:
        """Ctrl-C is for copying."""
        self._say(INFO, "q leaves the console")

    def action_load(self) -> None:
        """Hand the plan to the robot."""
        self.operator.load()

    def action_speed(self, steps: int) -> None:
        """Let simulated time pass faster or slower."""
        self.operator.change_speed(steps)

    def action_abort(self) -> None:
        """Give up the job, once confirmed."""

        def answered(yes: bool | None) -> None:
            if yes:
                self.operator.command("abort")

        text = "The robot stops and gives the job up. A pause (space) keeps it."
        self.push_screen(ConfirmDialog("Abort this job?", text, "Abort"), answered)

    def action_template(self) -> None:
        """Choose a template."""

        def chosen(result: Chosen | None) -> None:
            if result:
                self.operator.choose(*result)
                self.show_state()

        if self.operator.may_prepare("Template", needs_template=False):
            self.push_screen(TemplateDialog(), chosen)

    def _open_template(self, name_or_path: str) -> None:
        try:
            self.operator.choose(*read_template(name_or_path))
        except (TouchlineError, OSError) as error:
            self._autostart.stop()
            self._say(ERROR, f"Template: {error}")

    def action_plan(self) -> None:
        """Ask for options, then plan."""

        def chosen(options: PlanOptions | None) -> None:
            if options is not None:
                self.operator.plan(options)

        if self.operator.may_prepare("Plan", needs_template=True):
            areas = bool(self.state.template and self.state.template.template.areas)
            self.push_screen(PlanDialog(self.operator.options, self.state.vehicle, areas=areas), chosen)

    def action_follow(self) -> None:
        """Keep the robot in the middle of the map, or no longer."""
        self._map.set_follow(not self._map.follow)

    def action_fit(self) -> None:
        """Show the whole job."""
        self._map.fit()

    def action_zoom(self, steps: int) -> None:
        """Zoom the map."""
        self._map.zoom(steps)

    def action_keys(self) -> None:
        """List the keys."""
        self.push_screen(KeysDialog())

    async def action_quit(self) -> None:
        """Leave; asks first while the robot is on a job."""

        def answered(yes: bool | None) -> None:
            if yes:
                self.exit()

        stopping = self.state.orders.stop.phase is Phase.SENT
        if not self.state.busy and not stopping:
            self.exit()
        elif not isinstance(self.screen, ConfirmDialog):
            text = "The robot is on a job. Nobody watches it from here once this console is closed."
            if stopping:
                text = "The robot has not acknowledged the emergency stop, which only this console repeats."
            self.push_screen(ConfirmDialog("Leave the console?", text, "Leave"), answered)

    def get_system_commands(self, screen: Screen[object]) -> Iterable[SystemCommand]:
        """The command palette: every order by name."""
        yield from palette.commands(self, self.operator)
