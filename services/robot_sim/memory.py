"""Memory that a long-lived process has freed, given back to the system."""

import ctypes
import gc


def give_back() -> None:
    """Collect garbage and return what is free to the system: jobs of different sizes leave holes between what is kept.

    Takes some tens of milliseconds. Without glibc only garbage is collected.
    """
    gc.collect()
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
