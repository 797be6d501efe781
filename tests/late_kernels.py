"""Kernels that a process prepares, compiling them or loading them from the cache, after a point of time."""

from touchline.core.jit import Kernel


class LateKernels:
    """Lists them, each with what the process was doing then.

    In a process of its own: what another test has prepared is not prepared again.
    """

    def __init__(self):
        self.doing, self.found = "", []
        compile_or_load = Kernel.compile

        def listed(kernel, sig):
            known = len(kernel.overloads)
            code = compile_or_load(kernel, sig)
            if len(kernel.overloads) > known:
                self.found.append(f"{kernel.py_func.__module__}.{kernel.py_func.__name__} ({self.doing})")
            return code

        Kernel.compile = listed

    def tell(self):
        """Print them, a line each."""
