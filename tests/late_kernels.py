"""Kernels that a process prepares, compiling or loading them, after a point of time."""

from touchline.core.jit import Kernel


class LateKernels:
    """Lists them, each with what the process was doing then.

    In a process of its own: what another test has prepared is not prepared again.
    """

    def __init__(self):
        self.doing, self.found = "", []
        prepare = Kernel._made

        def listed(kernel, trees):
            self.found.append(f"{kernel.py_func.__module__}.{kernel.py_func.__name__} ({self.doing})")
            return prepare(kernel, trees)

        Kernel._made = listed

    def tell(self):
        """Print them, a line each."""
