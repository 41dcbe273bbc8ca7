from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from pathlib import Path

    from ros_parts import House


@pytest.fixture
def house(tmp_path: Path) -> House:
    from ros_parts import House  # it needs the extra `ros`

    return House(tmp_path)
