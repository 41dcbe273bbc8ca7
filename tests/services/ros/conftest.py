from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from pathlib import Path

    from ros_parts import FleetBench

# no package index has rclpy: these tests run where a ROS 2 is installed, by hand
collect_ignore = [] if find_spec("rclpy") else ["test_real_rclpy.py"]


@pytest.fixture
def bench(tmp_path: Path) -> FleetBench:
    from ros_parts import FleetBench  # it needs the extra `ros`

    return FleetBench(tmp_path)
