"""The bridge runs in the Python of a ROS installation: without a compiler, planners, and what else marsupial needs."""

import subprocess
import sys

import pytest

pytest.importorskip("httpx2")

HEAVY = ("llvmlite", "marsupial.native", "marsupial.planning", "marsupial_service", "numba", "scipy", "typer")
BLOCKED = f"""
import sys
sys.modules.update(dict.fromkeys({HEAVY}))
import marsupial_ros
import marsupial_ros.bridge
print(*sorted({{name.split('.')[0] for name, module in sys.modules.items() if module is not None}}))
"""


def test_the_bridge_imports_neither_compiler_nor_planner() -> None:
    done = subprocess.run([sys.executable, "-c", BLOCKED], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert not {"cbor2", "matplotlib", "rosbags", "skimage", "websockets"} & set(done.stdout.split())
