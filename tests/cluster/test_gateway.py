"""The gateway ends when its connection is useless, so that its server starts another; Ray is a fake."""

from __future__ import annotations

import asyncio
import json
import socket
from typing import Any

import pytest

from marsupial.cluster import gateway as module
from marsupial.cluster.gateway import STATE, Gateway
from marsupial.cluster.versions import Requirements


class Ray:
    """A fake cluster: the gateway's node, without processors, and others."""

    def __init__(self, *others: str) -> None:
        self.alive = {"own": True, **dict.fromkeys(others, True)}

    def get_runtime_context(self) -> Ray:
        return self

    def get_node_id(self) -> str:
        return "own"

    def nodes(self) -> list[dict[str, Any]]:
        return [{"NodeID": name, "Alive": alive, "Resources": {}} for name, alive in self.alive.items()]


def gateway_of(ray: Ray) -> Gateway:
    """Return a gateway without requests."""
    with socket.socket() as line:
        return Gateway(ray, line, Requirements(versions={}, token=False))


async def test_a_gateway_runs_while_its_node_lives_and_ends_when_that_is_dead_or_unknown() -> None:
    ray = Ray("other")
    gateway = gateway_of(ray)
    ray.alive["other"] = False
    await gateway.update_nodes()
    assert json.loads(gateway.answer(STATE, b""))[0] == "no cluster node is ready"
    ray.alive = {"own": False, "other": True}
    with pytest.raises(ConnectionError, match="the Ray node of this connection is dead"):
        await gateway.update_nodes()
    del ray.alive["own"]
    with pytest.raises(ConnectionError):
        await gateway.update_nodes()


async def test_a_gateway_gives_up_a_head_that_never_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_SILENCE_S", 0.01)
    gateway = gateway_of(Ray())

    async def never(*_: object) -> None:
        await asyncio.Event().wait()

    monkeypatch.setattr(gateway, "call", never)
    with pytest.raises(TimeoutError):
        await gateway.update_nodes()
