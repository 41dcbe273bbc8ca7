"""Fixtures that many tests share."""

from __future__ import annotations

from pathlib import Path

import pytest

SHARED_MAPS = Path(__file__).resolve().parents[2] / "shared" / "maps"


@pytest.fixture(scope="session")
def shared_maps() -> Path:
    """Folder of real maps that stands beside the checkout; tests that need it are skipped where it is absent."""
    if not SHARED_MAPS.is_dir():
        pytest.skip("the folder of real maps (../shared/maps) is not beside this checkout")
    return SHARED_MAPS
