"""The console's end of the terminal."""

from textual.drivers.linux_driver import LinuxDriver


class SturdyDriver(LinuxDriver):
    """Textual's own, but for input that is no UTF-8: line noise, a pasted binary, a terminal of another encoding.

    There it ends the whole console, and with it the operator's emergency stop. Here what was read with it is dropped.
    """

    def run_input_thread(self) -> None:
        """Read until the console is left."""
        while not self.exit_event.is_set():
            try:
                super().run_input_thread()
            except UnicodeDecodeError:
                continue
