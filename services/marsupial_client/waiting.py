"""The client for asyncio."""

from __future__ import annotations

from types import TracebackType
from typing import Self

import httpx2

from marsupial_client.conversation import Missed
from marsupial_client.core import Service, uses_environment
from marsupial_client.transports import Waiting


class AsyncClient(Service):
    """Talks to the service at `url`; to be closed after use, or used in a block.

    Parameters
    ----------
    url
        Like ``http://127.0.0.1:8080``.
    key
        The API key, if the service needs one.
    timeout_s
        How long to wait for a connection and for each part of an answer.
    patience_s
        How long to try again while the service is not there or busy; `math.inf` never gives up.
    missed
        Called with `Unreachable` or `Busy` when the service has been missed for a second or two; it is tried further.
    http
        What to send with, if it is to have certificates, proxies or hooks of its own; it is closed with the client.

    Raises
    ------
    ValueError
        If `url` is no address.
    """

    def __init__(
        self,
        url: str,
        *,
        key: str | None = None,
        timeout_s: float = 60.0,
        patience_s: float = 60.0,
        missed: Missed | None = None,
        http: httpx2.AsyncClient | None = None,
    ) -> None:
        http = http or httpx2.AsyncClient(trust_env=uses_environment(url))
        super().__init__(Waiting(http), url, key=key, timeout_s=timeout_s, patience_s=patience_s, missed=missed)

    async def close(self) -> None:
        """Close all connections."""
        await self.conversation.transport.close()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        await self.close()
