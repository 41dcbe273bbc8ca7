"""Put precompiled code into a wheel, which then is one for this operating system, architecture and Python.

It runs only where build hooks are asked for (`make wheel`): compiling takes what marsupial itself needs, and a minute.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class Precompiled(BuildHookInterface[Any]):
    """Compiles into a temporary folder, which becomes the package's folder of precompiled code."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile, unless the package is installed in place: ``make`` does that there."""
        if version == "editable":
            return
        self._folder = TemporaryDirectory(prefix="marsupial-")
        command = [sys.executable, "-m", "marsupial.library.precompiling", self._folder.name]
        subprocess.run(command, cwd=self.root, env={**os.environ, "PYTHONPATH": self.root}, check=True)
        if any(Path(self._folder.name).iterdir()):
            build_data["force_include"][self._folder.name] = "marsupial/precompiled"
            build_data["pure_python"] = False
            build_data["infer_tag"] = True

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove the temporary folder."""
        if version != "editable":
            self._folder.cleanup()
