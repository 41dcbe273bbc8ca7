"""Libraries whose internals change between releases are used by their documented interfaces only."""

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

DOCUMENTED = {
    "click": set[str](),  # typer no longer has it
    "numba": {"numba", "numba.config", "numba.core.event", "numba.extending", "numba.types"},
    "typer": {"typer", "typer.core"},  # for classes of commands and groups
    "uvicorn": {"uvicorn"},
}
"""The modules of these libraries that their documentation has."""

INTERNAL = {
    "marsupial/numba_internals.py"  # used where they are known, done without elsewhere: test_numba_internals.py
}


def test_no_module_uses_internals_of_these_libraries() -> None:
    found = {}
    for folder in ("marsupial", "services", "benchmarks"):
        for file in sorted((ROOT / folder).rglob("*.py")):
            name = file.relative_to(ROOT).as_posix()
            if name not in INTERNAL and (uses := sorted(internals(ast.parse(file.read_text(encoding="utf-8"))))):
                found[name] = uses
    assert found == {}


def test_uses_of_internals_are_found() -> None:
    source = """
import typer.main
from numba import njit, _helper
from numba.core.caching import NullCache
from numba.core import event

class Kept(NullCache):
    def _load(self): self._own = self._theirs

njit(print)._cache = None
"""
    assert internals(ast.parse(source)) == {
        "typer.main", "numba._helper", "numba.core.caching.NullCache", "_load in Kept", "._theirs", "._cache",
    }  # fmt: skip


def internals(tree: ast.Module) -> set[str]:
    """Return the undocumented names that a module imports from these libraries, and private names of their objects."""
    imported = list(_imported(tree))
    names = {name for name, *_ in imported}
    if not names:
        return set()
    found = {whole for _, whole, is_documented in imported if not is_documented}
    defined = {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.ClassDef)}
    attributes = [node for node in ast.walk(tree) if isinstance(node, ast.Attribute) and _is_private(node.attr)]
    # What a module sets on `self` is its own.
    defined |= {one.attr for one in attributes if isinstance(one.ctx, ast.Store) and _root(one) == "self"}
    defined |= {node.target.id for node in ast.walk(tree) if isinstance(node, ast.AnnAssign | ast.AugAssign)
                and isinstance(node.target, ast.Name)}  # fmt: skip
    found |= {f".{one.attr}" for one in attributes if one.attr not in defined}
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef) and names & set(map(_root, node.bases)):
            methods = [each.name for each in node.body if isinstance(each, ast.FunctionDef)]
            found |= {f"{name} in {node.name}" for name in methods if _is_private(name)}  # may override one of theirs
    return found


def _imported(tree: ast.Module) -> Iterator[tuple[str, str, bool]]:
    """Yield the local and the whole name of what is imported from these libraries, and whether it is documented."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.Import | ast.ImportFrom):
            continue
        module = node.module if isinstance(node, ast.ImportFrom) and not node.level else None
        for one in node.names:
            whole = one.name if module is None else f"{module}.{one.name}"
            if (modules := DOCUMENTED.get(whole.split(".")[0])) is not None:
                public = module in modules and not one.name.startswith("_")
                yield one.asname or one.name.split(".")[0], whole, public or whole in modules


def _is_private(name: str) -> bool:
    return name.startswith("_") and not name.endswith("__")


def _root(node: ast.expr) -> str | None:
    """Return the first name of an expression such as ``name.attribute[index]``."""
    while isinstance(node, ast.Attribute | ast.Subscript):
        node = node.value
    return node.id if isinstance(node, ast.Name) else None
