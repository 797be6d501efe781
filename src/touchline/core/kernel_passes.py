"""Passes of LLVM over the code of kernels: over each part alone, and once over a kernel with all its parts."""

from functools import cache
from typing import Any

import llvmlite.binding as llvm

from touchline.core.kernel_code import target_machine


def simplify(module: Any) -> None:
    """Make the code of a function smaller, once for all kernels that it is linked into."""
    passes = llvm.create_new_module_pass_manager()
    passes.add_sroa_pass()
    passes.add_simplify_cfg_pass()
    passes.add_instruction_combine_pass()
    passes.add_jump_threading_pass()
    passes.add_refprune_pass()
    passes.run(module, _builder())


def optimise(module: Any) -> None:
    """Optimise the code of a kernel and all that it calls; references are paired once more after inlining."""
    passes = _builder().getModulePassManager()
    passes.add_refprune_pass()
    passes.add_global_dead_code_eliminate_pass()
    passes.add_strip_dead_prototype_pass()
    passes.run(module, _builder())


@cache
def _builder() -> Any:
    """Pass builder with Numba's settings, for the machine that code is made for."""
    options = llvm.create_pipeline_tuning_options(3)
    options.loop_vectorization, options.slp_vectorization = True, False
    return llvm.create_pass_builder(target_machine(), options)
