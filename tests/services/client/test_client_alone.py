"""The client depends on httpx2 and its dependencies only."""

import ast
import subprocess
import sys
import tomllib
from pathlib import Path

from support.waiting import HANG_S

import marsupial
import marsupial_client

FOLDER = Path(marsupial_client.__file__).parent
ROOT = Path(__file__).resolve().parents[3]

PROGRAM = """
import sys

class OnlyItsOwn:
    allowed = {"marsupial_client", "anyio", "h11", "httpcore2", "httpx2", "idna", "truststore", "typing_extensions"}
    refused = []

    def find_spec(self, name, path=None, target=None):
        top = name.partition(".")[0]
        if top not in self.allowed and top not in sys.stdlib_module_names:
            self.refused.append(top)
            raise ImportError(f"{top} is not for the client")

sys.meta_path.insert(0, OnlyItsOwn())
from marsupial_client import AsyncClient, Client
Client("http://127.0.0.1:9").close()
print(*sorted({"marsupial", "numpy", "marsupial_service"} & (sys.modules.keys() | set(OnlyItsOwn.refused))), "imported")
"""


def test_the_client_works_without_other_packages() -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, timeout=HANG_S, check=False)
    assert (done.returncode, done.stdout) == (0, "imported\n"), done.stderr


def test_its_own_distribution_equals_the_one_within_marsupial() -> None:
    own = tomllib.loads((FOLDER / "pyproject.toml").read_text())
    whole = tomllib.loads((ROOT / "pyproject.toml").read_text())
    assert own["project"]["dependencies"] == whole["project"]["optional-dependencies"]["client"]
    assert own["project"]["requires-python"] == whole["project"]["requires-python"]
    assert marsupial_client.__version__ == marsupial.__version__


def test_every_public_name_has_a_docstring() -> None:
    undocumented = []
    for path in FOLDER.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            is_named = isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
            if is_named and not node.name.startswith("_") and ast.get_docstring(node) is None:
                undocumented.append(f"{path.name}: {node.name}")
    assert undocumented == []
