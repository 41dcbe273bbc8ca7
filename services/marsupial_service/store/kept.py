"""Values kept in the store as pickles, also those of earlier versions, in which some classes had other names."""

from __future__ import annotations

import io
import pickle
from typing import Any

_FORMER = {
    ("services.mapstate", "MapState"): ("marsupial_service.analyses.mapstate", "MapState"),
    ("marsupial.model.scenario", "Limits"): ("marsupial.model.scenario", "MissionLimits"),
}
"""Module and name of a class once, and now."""

_FORMER_PACKAGE, _PACKAGE = "services.", "marsupial_service."


def dumps(value: object) -> bytes:
    """Return a value as it is kept."""
    return pickle.dumps(value, protocol=pickle.HIGHEST_PROTOCOL)


def loads(data: bytes) -> Any:
    """Return the value that is kept so."""
    return _Unpickler(io.BytesIO(data)).load()


class _Unpickler(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        module, name = _FORMER.get((module, name), (module, name))
        if module.startswith(_FORMER_PACKAGE):
            module = _PACKAGE + module.removeprefix(_FORMER_PACKAGE)
        return super().find_class(module, name)
