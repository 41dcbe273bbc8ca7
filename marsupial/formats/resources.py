"""The files that come with marsupial, in a checkout or an installed wheel.

The folder ``pddl`` is at the top of a checkout, where people find it; a wheel has it as ``marsupial/data/pddl``.
"""

from __future__ import annotations

from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

from marsupial.errors import InternalError


def pddl_folder() -> Traversable:
    """Return the folder with ``domain.pddl``, its documentation and ``examples``.

    Raises
    ------
    InternalError
        If marsupial was installed without it.
    """
    checkout = Path(__file__).resolve().parents[2] / "pddl"
    for folder in (files("marsupial") / "data" / "pddl", checkout):
        if (folder / "domain.pddl").is_file():
            return folder
    raise InternalError("the folder pddl is neither in the installed package nor beside it")
