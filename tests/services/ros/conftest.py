from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from pathlib import Path

    from ros_parts import FleetBench


@pytest.fixture
def bench(tmp_path: Path) -> FleetBench:
    from ros_parts import FleetBench  # it needs the extra `ros`

    return FleetBench(tmp_path)
