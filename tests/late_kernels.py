"""Kernels that a process prepares, compiling or loading them, after a point of time, and those that cannot be kept."""

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
        for each in self.found:
            print(each)


def tell_of_numba():
    """From now on, print each kernel that only Numba's own function can run: no cache and no wheel has its code."""
    by_numba = Kernel._by_numba

    def told(kernel):
        print(f"{kernel.py_func.__module__}.{kernel.py_func.__name__} is compiled in every process")
        return by_numba(kernel)

    Kernel._by_numba = told
