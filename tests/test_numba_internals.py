"""numba still has the private names that `marsupial.native` and `marsupial.codecache` override or call.

A name that fails here has gone or moved in a new release of numba: adapt its user before the bound in pyproject.toml.
"""

import inspect

import pytest
from numba import njit
from numba.core.caching import Cache, FunctionCache, NullCache
from numba.core.codegen import JITCodeLibrary, JITCPUCodegen
from numba.core.compiler import CompilerBase, CompileResult
from numba.core.registry import CPUDispatcher
from numba.core.runtime import rtsys


@pytest.mark.parametrize(
    ("owner", "name", "parameters"),
    [
        (JITCodeLibrary, "_optimize_final_module", ["self"]),
        (JITCodeLibrary, "_finalize_final_module", ["self"]),
        (JITCodeLibrary, "_ensure_finalized", ["self"]),
        (JITCodeLibrary, "get_pointer_to_function", ["self", "name"]),
        (JITCPUCodegen, "set_env", ["self", "env_name", "env"]),
        (CompilerBase, "__init__", ["self", "typingctx", "targetctx", "library", "args", "return_type", "flags"]),
        (CPUDispatcher, "get_call_template", ["self", "args", "kws"]),
        (NullCache, "load_overload", ["self", "sig", "target_context"]),
        (NullCache, "flush", ["self"]),
        (Cache, "save_overload", ["self", "sig", "data"]),
        (FunctionCache, "_load_overload", ["self", "sig", "target_context"]),
        (CompileResult, "_reduce", ["self"]),
        (CompileResult, "_rebuild", ["cls", "target_context"]),
        (rtsys, "initialize", ["ctx"]),
    ],
    ids=lambda value: getattr(value, "__name__", None) or (value if isinstance(value, str) else ""),
)
def test_numba_still_takes_these_arguments(owner: object, name: str, parameters: list[str]) -> None:
    method = getattr(owner, name)
    found = list(inspect.signature(getattr(method, "__func__", method)).parameters)
    skipped = 1 if owner is rtsys else 0
    assert found[skipped : skipped + len(parameters)] == parameters


def test_numba_keeps_the_cache_of_a_function_and_the_state_of_a_library_where_they_are_replaced() -> None:
    assert isinstance(njit(lambda: 0)._cache, NullCache)
    assert JITCodeLibrary._finalized is False
    assert isinstance(JITCodeLibrary.codegen, property)
