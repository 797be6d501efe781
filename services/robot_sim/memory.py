"""Return of freed memory to the system, for a long-lived process."""

import ctypes
import gc


def give_back() -> None:
    """Collect garbage and return free memory to the system: jobs of different sizes leave holes between what is kept.

    Takes some tens of milliseconds. Without glibc only garbage is collected.
    """
    gc.collect()
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
