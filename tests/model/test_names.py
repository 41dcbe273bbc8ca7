import subprocess
import sys

import pytest

from marsupial import model


@pytest.mark.parametrize("name", model.__all__)
def test_every_value_is_there_by_its_name(name: str) -> None:
    assert getattr(model, name) is not None


def test_another_name_is_refused() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'Carier'"):
        model.Carier  # noqa: B018


def test_naming_the_package_imports_no_numpy() -> None:
    code = "import sys, marsupial.model; from marsupial.model import StrategyInfo; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
