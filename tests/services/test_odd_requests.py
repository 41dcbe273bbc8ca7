"""Requests that servers and proxies could read in different ways."""

from pathlib import Path

from odd_requests import ODD_REQUESTS, statuses
from support.services.proxies import Proxy, needs_nginx
from support.services.servers import Server


def test_odd_requests_are_read_in_one_way_or_refused(server: Server) -> None:
    found = {name: statuses(server.port, odd.sent, len(odd.direct)) for name, odd in ODD_REQUESTS.items()}
    assert found == {name: odd.direct for name, odd in ODD_REQUESTS.items()}


@needs_nginx
def test_odd_requests_are_read_in_one_way_or_refused_behind_the_proxy(tmp_path: Path, server: Server) -> None:
    expected = {name: odd.direct if odd.proxied is None else odd.proxied for name, odd in ODD_REQUESTS.items()}
    with Proxy(tmp_path, [server.port]) as proxy:
        found = {name: statuses(proxy.port, odd.sent, len(expected[name])) for name, odd in ODD_REQUESTS.items()}
    assert found == expected
