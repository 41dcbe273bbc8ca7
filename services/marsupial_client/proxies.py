"""Which proxy of the environment to ask for an address: one rule for HTTP and websockets.

This machine and its local network are asked directly: a proxy for the internet can't reach them, and every library
judges them differently. All other addresses follow the environment (``http_proxy``, ``all_proxy``, ``no_proxy``, in
lower or upper case), or the settings of the operating system where the environment is silent.
"""

import ipaddress
import os
import re
from dataclasses import dataclass
from urllib.parse import urlsplit
from urllib.request import getproxies, proxy_bypass

from marsupial_client.errors import ProxyUnusable

# for each scheme of an address, the proxies that can take it, the best first; websockets as in RFC 6455, section 4.1
_CANDIDATES = {
    "http": ("http", "all"),
    "https": ("https", "all"),
    "ws": ("ws", "socks", "https", "http", "all"),
    "wss": ("wss", "socks", "https", "all"),
}
_PORTS = {"http": 80, "https": 443, "ws": 80, "wss": 443}
_PROXY_PORTS = {"http": 80, "https": 443, "socks4": 1080, "socks4a": 1080, "socks5": 1080, "socks5h": 1080}

_THIS_MACHINE = ("127.0.0.0/8", "::1/128", "0.0.0.0/32", "::/128")
_PRIVATE = ("10.0.0.0/8", "172.16.0.0/12", "192.168.0.0/16", "fc00::/7")
_LINK_LOCAL = ("169.254.0.0/16", "fe80::/10")
# VPNs between machines use it (RFC 6598)
_SHARED = ("100.64.0.0/10",)
LOCAL_NETWORKS = tuple(map(ipaddress.ip_network, (*_THIS_MACHINE, *_PRIVATE, *_LINK_LOCAL, *_SHARED)))
LOCAL_DOMAINS = ("localhost", "local", "lan", "home.arpa")


@dataclass(frozen=True, slots=True)
class EnvironmentProxy:
    """A proxy, and the variable of the environment that names it."""

    variable: str
    url: str

    def __str__(self) -> str:
        """Return where it is, without a password."""
        parts = urlsplit(self.url)
        return f"the proxy {parts.scheme}://{parts.netloc.rpartition('@')[2]} of {self.variable}"

    def unusable(self, why: str) -> ProxyUnusable:
        """Return the error that says why this proxy can't be used, and what to do instead."""
        return ProxyUnusable(f"{self} can't be used: {why}; or unset {self.variable}, or list the host in no_proxy")


def proxy_for(url: str) -> EnvironmentProxy | None:
    """Return the proxy to ask for an address (http, https, ws, wss), or None. Raises ProxyUnusable."""
    try:
        parts = urlsplit(url)
        host, port = parts.hostname or "", parts.port or _PORTS.get(parts.scheme, 0)
    except ValueError:  # no address: whoever connects to it says so
        return None
    if is_local(host) or _is_exempt(host, port):
        return None
    found = getproxies()
    texts = ((kind, found.get(kind, "").strip()) for kind in _CANDIDATES.get(parts.scheme, ()))
    return next((_proxy(kind, text) for kind, text in texts if text), None)


def is_local(host: str) -> bool:
    """Return whether a host is this machine or in its local network, judged by its address or name alone."""
    host = host.rstrip(".").lower()
    address = _address(host)
    if address is None:
        return "." not in host or host.endswith(tuple(f".{domain}" for domain in LOCAL_DOMAINS))
    return any(address in network for network in LOCAL_NETWORKS)


def _is_exempt(host: str, port: int) -> bool:
    """Return whether no_proxy names a host: itself, its domain, its network, or everything."""
    host = host.rstrip(".").lower()
    address = _address(host)
    for entry in getproxies().get("no", "").lower().replace(",", " ").split():
        name = entry.removesuffix(f":{port}").strip("[]").removeprefix("*").lstrip(".")
        if entry == "*" or (name and (host == name or host.endswith(f".{name}"))):
            return True
        try:
            if address is not None and address in ipaddress.ip_network(name, strict=False):
                return True
        except ValueError:  # no network
            continue
    # the operating system has such a list too
    return bool(proxy_bypass(f"{host}:{port}"))


def _address(host: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    try:
        address = ipaddress.ip_address(host.strip("[]"))
    except ValueError:
        return None
    return getattr(address, "ipv4_mapped", None) or address


def _proxy(kind: str, text: str) -> EnvironmentProxy:
    # `getproxies` prefers lower case
    names = sorted((name for name in os.environ if name.lower() == f"{kind}_proxy"), reverse=True)
    variable = next((name for name in names if os.environ[name].strip() == text), "the system's settings")
    try:
        parts = urlsplit(text if "://" in text else f"http://{text}")
        scheme, host, port = parts.scheme, parts.hostname, parts.port
    except ValueError:
        scheme, host, port = "", None, None
    if scheme == "socks" or (kind == "socks" and scheme == "http"):  # as desktops write it
        scheme = "socks5h"
    if scheme not in _PROXY_PORTS or host is None or any(map(str.isspace, text)):
        shown = re.sub(r"[^/]*@", "...@", text)
        raise ProxyUnusable(f"{variable} must be like http://HOST:PORT or socks5://HOST:PORT, got {shown!r}")
    user, mark, _ = parts.netloc.rpartition("@")
    user += ":" if mark and ":" not in user else ""  # libraries want a password, if only an empty one
    place = f"[{host}]" if ":" in host else host
    return EnvironmentProxy(variable, f"{scheme}://{user}{mark}{place}:{port or _PROXY_PORTS[scheme]}")
