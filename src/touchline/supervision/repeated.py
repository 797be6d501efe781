"""Work that is repeated in another thread."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def repeated(work: Callable[[], object], every_s: float, name: str) -> Iterator[None]:
    """Call `work` now and then until the context is left, which waits for a call that is under way.

    Args:
        work: Called in another thread; must not raise.
        every_s: Time before the first call, and between two.
        name: Name of the thread.
    """
    done = threading.Event()

    def repeat() -> None:
        while not done.wait(every_s):
            work()

    thread = threading.Thread(target=repeat, name=name, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()
