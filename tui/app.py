"""Console application: polls the links, updates the state, redraws panels, maps keys to orders."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable
from functools import partial
from typing import ClassVar

from textual import events
from textual.app import App, ComposeResult, SystemCommand
from textual.binding import BindingType
from textual.containers import Horizontal, Vertical
from textual.driver import Driver
from textual.drivers.linux_driver import LinuxDriver
from textual.filter import Monochrome
from textual.message import Message
from textual.screen import Screen

from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages.plan_messages import PlanOptions, PoseGoal
from touchline.schemas.messages.touchline import TraversalStatus
from touchline.tui import palette, questions, theme
from touchline.tui.autostart import AutoStart
from touchline.tui.colors import Grey, Sixteen, has_sixteen_colors
from touchline.tui.desks import Desks
from touchline.tui.dialogs import ConfirmDialog, PlanDialog
from touchline.tui.driver import SturdyDriver
from touchline.tui.event_log import ERROR, INFO, WARN
from touchline.tui.fleet_dialog import FleetDialog
from touchline.tui.fleet_orders import FleetOrder, concerned
from touchline.tui.fleet_screen import FleetScreen
from touchline.tui.goal_dialog import GoalDialog
from touchline.tui.header import HeaderBar
from touchline.tui.key_bar import KeyBar
from touchline.tui.keys import TABLE, bindings
from touchline.tui.keys_dialog import KeysDialog
from touchline.tui.lines_view import SegmentsTable
from touchline.tui.log_view import LogView
from touchline.tui.map_view import MapView
from touchline.tui.operator import Operator
from touchline.tui.orders import OrderOutcome, Tried
from touchline.tui.panels import ServicesPanel, StatusPanel
from touchline.tui.protocol import Links
from touchline.tui.robots_bar import RobotsBar
from touchline.tui.signal_bar import SignalBar
from touchline.tui.state import ConsoleState
from touchline.tui.stop_screen import Palette
from touchline.tui.template_dialog import Chosen, TemplateDialog, read_template
from touchline.tui.unfinished_job import offered

POLL_HZ = 12


class OrderNews(Message):
    """An order to a robot was sent again or came back; posted from its thread."""

    def __init__(self, robot: str, news: Tried | OrderOutcome) -> None:
        """Create the message for a robot."""
        super().__init__()
        self.robot, self.news = robot, news


class ConsoleApp(App[None]):
    """An operator's console over links to robots."""

    TITLE = "Touchline"
    CSS_PATH = "console.tcss"
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (100, "-normal"), (160, "-wide")]  # noqa: RUF012, as in the base class
    VERTICAL_BREAKPOINTS = [(0, "-low"), (34, "-high")]  # noqa: RUF012, as in the base class
    BINDINGS: ClassVar[list[BindingType]] = [*bindings(TABLE)]

    def __init__(
        self,
        links: Links,
        autostart: AutoStart | None = None,
        *,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Create the console for `links`; `clock` measures silence and paces repeats."""
        super().__init__()
        self._desks = Desks(links, clock, self._post_news)
        self.robots = self._desks.robots
        self._autostart = autostart or AutoStart()
        self._started_with = self._desks.selected
        self._started_with.wanted_closely = lambda: self._autostart.under_way
        self._stop_typed_s = -math.inf
        self._stops = 0
        self._signals_due = False
        self._header, self._signals, self._keys = HeaderBar(), SignalBar(), KeyBar()
        self._robots_bar = RobotsBar()
        self._map, self._log_view = MapView(), LogView()
        self._status, self._services, self._segments = StatusPanel("Status"), ServicesPanel("Services"), SegmentsTable()
        self._filters = [Grey() if isinstance(filter, Monochrome) else filter for filter in self._filters]
        self.register_theme(theme.THEME)
        self.theme = theme.THEME.name

    @property
    def state(self) -> ConsoleState:
        """State of the robot in view."""
        return self.robots.selected

    @property
    def operator(self) -> Operator:
        """Operator of the robot in view."""
        return self._desks.selected.operator

    def compose(self) -> ComposeResult:
        """Lay out header, robots if there are several, orders and alerts; map and log, left; panels, right; keys."""
        yield self._header
        yield self._robots_bar
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
        """Start polling."""
        if has_sixteen_colors(self):
            self._filters.append(Sixteen())
        self._map.focus()
        if self._autostart.template is not None:
            self._open_template(self._autostart.template)
        self.set_interval(1 / POLL_HZ, self.tick)
        self.call_after_refresh(self.tick)

    # -- what comes in -----------------------------------------------------------------------------------------------

    def tick(self) -> None:
        """Take what came in, send due orders, and update the screen."""
        self._desks.tick(self._start)
        self._autostart.go_on(self._started_with.operator)
        self._drop_void_question()
        self.show_state()

    def _drop_void_question(self) -> None:
        """Close a question that is void: an answer would refer to an earlier situation."""
        if not self._map.is_attached:
            return
        if isinstance(self.screen, ConfirmDialog) and (reason := self.screen.void()):
            question = self.screen.question
            self.screen.dismiss(None)
            self.state.say(WARN, f"{question} Not asked any more: {reason}")

    def _post_news(self, robot: str, news: Tried | OrderOutcome) -> None:
        self.post_message(OrderNews(robot, news))

    def show_state(self) -> None:
        """Update every panel; each redraws only what changed."""
        if not self._map.is_attached:  # an answer may still come in while the console is being taken down
            return
        if (fleet := self.fleet_screen) is not None:
            fleet.show()
            self._show_signals()
            return
        state = self.state
        self.screen_stack[0].set_class(state.traversal == TraversalStatus.ESTOPPED, "-stopped-robot")
        for panel in (self._header, self._status, self._services, self._segments, self._keys):
            panel.show(state)
        self._map.show(self.robots)
        self._robots_bar.show(self.robots)
        self._log_view.show(state.log)
        self._show_signals()

    def _show_signals(self) -> None:
        """Update the row of the orders, on dialogs, too."""
        self._signals_due = False
        if self._signals.is_attached:
            for screen in self.screen_stack:
                for bar in screen.query(SignalBar):
                    bar.show(self.robots)

    def on_order_news(self, event: OrderNews) -> None:
        """Process the outcome of an order; the next tick shows all changes."""
        desk = self._desks.find(event.robot)
        if desk is None:
            return
        if isinstance(event.news, Tried):
            desk.operator.tried(event.news)
        else:
            ok = desk.operator.done(event.news)
            if desk is self._started_with:
                self._autostart.done(event.news.order.name, ok)
                self._autostart.go_on(desk.operator)
        if not self._signals_due:  # once for all that has come: hundreds of robots answer an emergency stop together
            self._signals_due = self.call_later(self._show_signals)

    # -- keys --------------------------------------------------------------------------------------------------------

    def action_command(self, name: str) -> None:
        """Send an order without arguments; resume without a pause continues an unfinished job."""
        operator = self.operator
        if self.state.replayed and name in ("pause", "resume"):
            (operator.replay.toggle if name == "pause" else operator.replay.resume)()
        elif name == "start":
            self._start(operator)
        elif name == "resume" and offered(self.state) is not None:
            operator.go_on()
        else:
            operator.command(name)
        self._show_signals()

    def _start(self, operator: Operator) -> None:
        """Start the loaded plan; asks first if tank or battery may not last."""
        start = partial(operator.command, "start")  # the robot in view may be another by the time it is answered
        self._ask(questions.before_start(operator.state), start)

    def _ask(self, question: ConfirmDialog | None, act: Callable[[], object]) -> None:
        """Act once a question is answered with yes; at once without one, not at all while another is open."""

        def answered(yes: bool | None) -> None:
            if yes:
                act()

        if question is None:
            act()
        elif not isinstance(self.screen, ConfirmDialog):
            self.push_screen(question, answered)

    @property
    def breakdown(self) -> Exception | None:
        """Error that ended the console, if any."""
        return self._exception

    def _print_error_renderables(self) -> None:
        """Print nothing but with ``TEXTUAL=debug``: the caller reports a breakdown in one line."""
        if "debug" not in self.features:
            self._exit_renderables.clear()
        super()._print_error_renderables()

    def get_driver_class(self) -> type[Driver]:
        """Replace the terminal's driver; others, such as for a browser, are kept."""
        usual = super().get_driver_class()
        return SturdyDriver if usual is LinuxDriver else usual

    def stop_at_once(self, typed_s: float) -> None:
        """Stop the robots, from the thread that reads the keys; keys typed before are dropped."""
        self._stop_typed_s = typed_s
        self._stop_all()

    def _stop_all(self) -> None:
        """Stop every robot: stopping one too many costs a minute, stopping the wrong one may cost more."""
        self._stops += 1
        names = self._desks.stop()
        if self.state.replayed:
            others = f"it goes to {', '.join(names)}" if names else "no robot is on the bus"
            self.state.say(WARN, f"Emergency stop: {self.state.name} is a replay and cannot be stopped; {others}")
        if names:
            self.robots.call_roll("estop", "Emergency stop", names)

    async def on_event(self, event: events.Event) -> None:
        """Drop keys that were typed before an emergency stop and come after it, such as a reset."""
        if isinstance(event, events.Key) and event.time < self._stop_typed_s:
            return
        await super().on_event(event)

    def action_estop(self) -> None:
        """Stop the robots at any time."""
        self._stop_all()
        self._autostart.stop()
        self._drop_void_question()
        self._show_signals()

    def action_command_palette(self) -> None:
        """Open the palette of all commands."""
        if not isinstance(self.screen, Palette):
            self.push_screen(Palette(id="--command-palette"))

    def action_help_quit(self) -> None:
        """Explain how to quit, as Ctrl-C is for copying."""
        self.state.say(INFO, "q leaves the console")

    def action_load(self) -> None:
        """Load the plan into the robot; asks first if that abandons an unfinished job."""
        self._ask(questions.before_load(self.state), self.operator.load)

    def action_speed(self, steps: int) -> None:
        """Change the speed of simulated time by steps."""
        if self.state.replayed:
            self.operator.replay.change_speed(steps)
        else:
            self.operator.change_speed(steps)

    def action_seek(self, seconds: float) -> None:
        """Seek in a replay by a time (s)."""
        self.operator.replay.seek_by(seconds)

    def action_step(self) -> None:
        """Advance a replay by one step."""
        self.operator.replay.step()

    def action_go_on(self) -> None:
        """Continue the job that an abort or a restart of the robot interrupted."""
        self.operator.go_on()

    def action_abort(self) -> None:
        """Abort the job, once confirmed."""
        question = None if self.state.replayed else questions.before_abort(self.state)  # the refusal gives the reason
        self._ask(question, partial(self.operator.command, "abort"))

    def action_template(self) -> None:
        """Choose a template."""
        operator = self.operator

        def chosen(result: Chosen | None) -> None:
            if result:
                operator.choose(*result)
                self.show_state()

        if operator.may_prepare("Template", needs_template=False):
            self.push_screen(TemplateDialog(), chosen)

    def _open_template(self, name_or_path: str) -> None:
        try:
            self.operator.choose(*read_template(name_or_path))
        except (TouchlineError, OSError) as error:
            self._autostart.stop()
            self.state.say(ERROR, f"Template: {error}")

    def action_plan(self) -> None:
        """Ask for options, then plan."""
        operator = self.operator

        def chosen(options: PlanOptions | None) -> None:
            if options is not None:
                operator.plan(options)

        if operator.may_prepare("Plan", needs_template=True):
            areas = bool(self.state.template and self.state.template.template.areas)
            self.push_screen(PlanDialog(operator.options, self.state.vehicle, areas=areas), chosen)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Disable actions on a goal unless the operator aims, and actions on a replay without one."""
        if action in ("seek", "step"):
            return self.state.replayed
        aiming = self.state.drive.goal is not None
        return aiming if action in ("aim", "turn") else super().check_action(action, parameters)

    def action_drive(self) -> None:
        """Aim at a goal on the map."""
        self.operator.goals.aim()
        self._map.focus()
        self.show_state()
        self._map.show_goal()

    def action_turn(self, steps: int) -> None:
        """Turn the goal's heading."""
        self.state.drive.turn(steps, self.state.robot.pose)
        self.show_state()

    def action_aim(self, step: str) -> None:
        """Take a step towards the goal: preview and then drive (`go`), any heading (`free`), `how`, or `leave`."""
        operator, draft = self.operator, self.state.drive
        if step == "free":
            draft.free_heading()
        elif step == "leave":
            operator.goals.leave()
        elif step == "how" and draft.goal is not None:
            self._ask_how(operator, draft.goal)
        elif draft.ready:
            operator.goals.drive()
        else:
            operator.goals.preview()
        self.show_state()

    def _ask_how(self, operator: Operator, goal: PoseGoal) -> None:
        def chosen(goal: PoseGoal | None) -> None:
            if goal is not None:
                operator.state.drive.choose(goal)
                operator.goals.preview()

        self.push_screen(GoalDialog(goal), chosen)

    def on_goal_moved(self) -> None:
        """Show the moved goal."""
        self.show_state()

    def action_next_robot(self) -> None:
        """Select the next robot, to which orders go from now on."""
        self.robots.select_next()
        if (fleet := self.fleet_screen) is not None:
            fleet.show_picked()
        else:
            self.show_state()

    def action_select(self, name: str) -> None:
        """Select a robot."""
        self.robots.select(name)
        self.show_state()

    @property
    def fleet_screen(self) -> FleetScreen | None:
        """Screen of all robots, if it is open, possibly below dialogs."""
        return next((screen for screen in self.screen_stack if isinstance(screen, FleetScreen)), None)

    def action_fleet(self) -> None:
        """Show all robots."""
        if self.state.alone:
            self.state.say(INFO, f"Fleet: {self.state.name} is the only robot; others are taken up as they come")
        elif self.fleet_screen is None:
            self.push_screen(FleetScreen(self.robots), lambda _: self.show_state())

    def action_one_at_a_time(self) -> None:
        """Explain that jobs are prepared on the screen of one robot."""
        self.state.say(INFO, "jobs and goals are prepared for one robot: enter shows it alone")

    def action_order_all(self) -> None:
        """Ask which order is to go to all robots."""
        if self.state.alone:
            self.state.say(INFO, f"All: {self.state.name} is the only robot")
            return

        def chosen(order: FleetOrder | None) -> None:
            if order is not None:
                self._confirm_for_all(order)

        self.push_screen(FleetDialog(self.robots.states), chosen)

    def _confirm_for_all(self, order: FleetOrder) -> None:
        names = concerned(order, self.robots.states)
        if not names:
            self.state.say(WARN, f"{order.title}: there are no robots for it ({order.whom})")
            return

        stops = self._stops
        question = questions.before_all(order, names, self.robots, lambda: self._stops != stops)
        self._ask(question, partial(self._order_all, order, names))

    def _order_all(self, order: FleetOrder, names: Iterable[str]) -> None:
        """Send an order to all robots that it still concerns, and show their answers."""
        desks = {name: desk for name in names if (desk := self._desks.find(name)) and order.concerns(desk.state)}
        for desk in desks.values():
            desk.operator.command(order.name)
        self.robots.call_roll(order.name, order.title, desks)
        self.action_fleet()
        self.show_state()

    def action_follow(self) -> None:
        """Toggle keeping the robot in the middle of the map."""
        self._map.set_follow(not self._map.follow)

    def action_fit(self) -> None:
        """Show the whole job."""
        self._map.fit()

    def action_zoom(self, steps: int) -> None:
        """Zoom the map."""
        self._map.zoom(steps)

    def action_keys(self) -> None:
        """List the keys."""
        self.push_screen(KeysDialog(fleet=self.fleet_screen is not None))

    async def action_quit(self) -> None:
        """Quit; asks first while the robot is on a job."""
        self._ask(questions.before_leaving(self.robots), self.exit)

    def get_system_commands(self, screen: Screen[object]) -> Iterable[SystemCommand]:
        """Commands of the palette."""
        yield from palette.commands(self, self.operator)
