"""The proxy of docker/: nginx with the configuration of the container, which differs only in ports and folders."""

import os
import re
import shutil
import signal
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Self

import pytest
from support.services.plain_client import BROKEN, ask
from support.services.servers import free_port
from support.waiting import HANG_S, wait_until

CONFIGURATION = Path(__file__).resolve().parents[3] / "docker" / "nginx.conf"
NGINX = shutil.which("nginx") or shutil.which("nginx", path="/usr/sbin")

needs_nginx = pytest.mark.skipif(NGINX is None, reason="nginx is not installed (Debian: apt-get install nginx-light)")


class Proxy:
    """nginx in front of servers at these ports; it runs within a `with` block.

    Parameters
    ----------
    folder
        Where its files are.
    directives
        Other values of directives of the configuration, by name.
    """

    def __init__(self, folder: Path, ports: list[int], directives: Mapping[str, str] | None = None) -> None:
        self.port = free_port()
        self._folder = folder
        text = CONFIGURATION.read_text()
        servers = re.findall(r"server-\d+:8080", text)
        for i, server in enumerate(servers):
            text = text.replace(server, f"127.0.0.1:{ports[i % len(ports)]}")
        text = _replaced(text, "listen", f"127.0.0.1:{self.port}").replace("/tmp/", f"{folder}/")
        for name, value in (directives or {}).items():
            text = _replaced(text, name, value)
        (folder / "nginx.conf").write_text(text)

    def __enter__(self) -> Self:
        assert NGINX is not None
        # in the container, nginx doesn't run as root, whose workers would run as another user
        options = "daemon off;" + (" user root;" if os.geteuid() == 0 else "")
        command = [NGINX, "-c", str(self._folder / "nginx.conf"), "-p", str(self._folder), "-g", options]
        with (self._folder / "nginx.log").open("wb") as log:
            self._process = subprocess.Popen(command, stdout=log, stderr=log)
        wait_until(self._answers, "nginx")
        return self

    def __exit__(self, *_: object) -> None:
        self._process.send_signal(signal.SIGTERM)
        self._process.wait(HANG_S)

    @property
    def log(self) -> str:
        return (self._folder / "nginx.log").read_text(errors="replace")

    def _answers(self) -> bool:
        assert self._process.poll() is None, self.log
        try:
            ask(self.port, "GET", "/healthz")
        except BROKEN:
            return False
        return True


def _replaced(text: str, directive: str, value: str) -> str:
    """Return a configuration with another value of a directive, which it must have once."""
    text, count = re.subn(rf"^( *{directive}) [^;]*;", rf"\1 {value};", text, flags=re.MULTILINE)
    assert count == 1, directive
    return text
