"""Odd requests, and the statuses that answer them: directly, and behind the proxy if they differ there.

Servers and proxies that disagree about where a request ends, or which host it is for, can be made to take a part of
one request for another. What is refused closes the connection, so that nothing that follows counts as a request.
"""

import re
import socket
from contextlib import suppress
from typing import NamedTuple

from support.services.plain_client import HOST
from support.waiting import HANG_S

HOST_LINE = b"Host: localhost\r\n"
CHUNKED = b"Transfer-Encoding: chunked\r\n"
# another request in what may be the body
SMUGGLED = b"0\r\n\r\nGET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n"
UPGRADE = b"Connection: Upgrade, HTTP2-Settings\r\nUpgrade: h2c\r\nHTTP2-Settings: AAMAAABkAAQAAP__\r\n"


class Odd(NamedTuple):
    """A request, and the statuses of all answers on its connection; `proxied`: behind the proxy, None: the same."""

    sent: bytes
    direct: list[int]
    proxied: list[int] | None = None


def get(headers: bytes = b"", line: bytes = b"GET /healthz HTTP/1.1", host: bytes = HOST_LINE) -> bytes:
    return line + b"\r\n" + host + headers + b"\r\n"


def post(headers: bytes, body: bytes) -> bytes:
    head = b"POST /v1/analysis HTTP/1.1\r\n" + HOST_LINE + b"Content-Type: application/json\r\n"
    return head + headers + b"\r\n" + body


def chunks(body: bytes) -> bytes:
    return post(CHUNKED, body)


ODD_REQUESTS = {
    "two lengths": Odd(post(b"Content-Length: 2\r\nContent-Length: 3\r\n", SMUGGLED), [400]),
    "the same length twice": Odd(post(b"Content-Length: 2\r\nContent-Length: 2\r\n", b"{}"), [400]),
    "list of lengths": Odd(post(b"Content-Length: 2, 3\r\n", SMUGGLED), [400]),
    "length, then coding": Odd(post(b"Content-Length: 2\r\n" + CHUNKED, SMUGGLED), [400]),
    "coding, then length": Odd(post(CHUNKED + b"Content-Length: 2\r\n", SMUGGLED), [400]),
    "negative length": Odd(post(b"Content-Length: -2\r\n", SMUGGLED), [400]),
    "length with a plus": Odd(post(b"Content-Length: +2\r\n", b"{}"), [400]),
    "hexadecimal length": Odd(post(b"Content-Length: 0x2\r\n", b"{}"), [400]),
    "length with a space": Odd(post(b"Content-Length: 2 2\r\n", b"{}"), [400]),
    "empty length": Odd(post(b"Content-Length: \r\n", b""), [400]),
    "length with zeros": Odd(post(b"Content-Length: 0000000002\r\n", b"{}"), [422]),
    "length of 30 digits": Odd(post(b"Content-Length: " + b"9" * 30 + b"\r\n", b"{}"), [400]),
    "length that overflows": Odd(post(b"Content-Length: 18446744073709551618\r\n", b"{}"), [400]),
    "coding identity": Odd(post(b"Transfer-Encoding: identity\r\n", SMUGGLED), [400], [501]),
    "codings gzip, chunked": Odd(post(b"Transfer-Encoding: gzip, chunked\r\n", SMUGGLED), [400], [501]),
    "codings chunked, gzip": Odd(post(b"Transfer-Encoding: chunked, gzip\r\n", SMUGGLED), [400], [501]),
    "codings chunked, chunked": Odd(post(b"Transfer-Encoding: chunked, chunked\r\n", SMUGGLED), [400], [501]),
    "coding twice": Odd(post(CHUNKED + CHUNKED, SMUGGLED), [400]),
    "coding xchunked": Odd(post(b"Transfer-Encoding: xchunked\r\n", SMUGGLED), [400], [501]),
    "coding in capitals": Odd(post(b"Transfer-Encoding: CHUNKED\r\n", b"2\r\n{}\r\n0\r\n\r\n"), [422]),
    "vertical tab before a coding": Odd(post(b"Transfer-Encoding: \x0bchunked\r\n", SMUGGLED), [400], [501]),
    "quoted coding": Odd(post(b'Transfer-Encoding: "chunked"\r\n', SMUGGLED), [400], [501]),
    "space after a header's name": Odd(post(b"Transfer-Encoding : chunked\r\n", SMUGGLED), [400]),
    "chunks": Odd(chunks(b"2\r\n{}\r\n0\r\n\r\n"), [422]),
    "chunk size 0x2": Odd(chunks(b"0x2\r\n{}\r\n0\r\n\r\n"), [400]),
    "chunk size +2": Odd(chunks(b"+2\r\n{}\r\n0\r\n\r\n"), [400]),
    "chunk size with 100 zeros": Odd(chunks(b"0" * 100 + b"2\r\n{}\r\n0\r\n\r\n"), [422]),
    "chunk size that overflows": Odd(chunks(b"10000000000000002\r\n{}\r\n0\r\n\r\n"), [400]),
    "no chunk size": Odd(chunks(b"\r\n{}\r\n0\r\n\r\n"), [400]),
    "chunk lines that end with LF": Odd(chunks(b"2\n{}\n0\n\n"), [400], [422]),
    "chunk without an end": Odd(chunks(b"2\r\n{}XX0\r\n\r\n"), [400]),
    "space before a chunk size": Odd(chunks(b" 2\r\n{}\r\n0\r\n\r\n"), [400]),
    "space after a chunk size": Odd(chunks(b"2 \r\n{}\r\n0\r\n\r\n"), [400], [422]),
    "chunk extension": Odd(chunks(b'2;a="b;c"\r\n{}\r\n0\r\n\r\n'), [422]),
    "chunk extension with LF": Odd(chunks(b"2;a\nGET\r\n{}\r\n0\r\n\r\n"), [400]),
    "trailers": Odd(chunks(b"2\r\n{}\r\n0\r\nX-A: b\r\n\r\n"), [422]),
    "length in trailers": Odd(chunks(b"2\r\n{}\r\n0\r\nContent-Length: 5\r\n\r\n"), [400], [422]),
    "bare CR in a header": Odd(get(b"X-A: b\rc\r\n"), [400]),
    "lines that end with CR": Odd(b"GET /healthz HTTP/1.1\rHost: localhost\r\r", [400]),
    "NUL in a header": Odd(get(b"X-A: b\x00c\r\n"), [400]),
    "NUL in a name": Odd(get(b"X\x00A: b\r\n"), [400]),
    "NUL in the target": Odd(get(line=b"GET /heal\x00thz HTTP/1.1"), [400]),
    "control character in a header": Odd(get(b"X-A: b\x01c\r\n"), [400]),
    "space in a name": Odd(get(b"X A: b\r\n"), [400]),
    "empty name": Odd(get(b": b\r\n"), [400]),
    "header without a colon": Odd(get(b"X-A\r\n"), [400], [200]),  # nginx doesn't pass it on
    "folded header": Odd(get(b"X-A: b\r\n c\r\n"), [400]),
    "folded first header": Odd(b"GET /healthz HTTP/1.1\r\n X: y\r\nHost: localhost\r\n\r\n", [400]),
    "folded coding": Odd(post(b"Transfer-Encoding:\r\n chunked\r\n", SMUGGLED), [400]),
    "folded length": Odd(post(b"Content-Length:\r\n 2\r\n", b"{}"), [400]),
    "lines that end with LF": Odd(b"GET /healthz HTTP/1.1\nHost: localhost\n\n", [400], [200]),
    "preface of HTTP/2": Odd(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", [400]),
    "TLS": Odd(b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n", [400]),
    "HTTP/1.0": Odd(get(line=b"GET /healthz HTTP/1.0"), [200]),
    "HTTP/1.2": Odd(get(line=b"GET /healthz HTTP/1.2"), [400], [200]),
    "HTTP/3.0": Odd(get(line=b"GET /healthz HTTP/3.0"), [400], [505]),
    "lower case http": Odd(get(line=b"GET /healthz http/1.1"), [400]),
    "RTSP": Odd(get(line=b"DESCRIBE /healthz RTSP/1.0"), [405], [400]),
    "tabs in the request line": Odd(get(line=b"GET\t/healthz\tHTTP/1.1"), [400]),
    "space in the target": Odd(get(line=b"GET /heal thz HTTP/1.1"), [400]),
    "space before the method": Odd(get(line=b" GET /healthz HTTP/1.1"), [400]),
    "method in lower case": Odd(get(line=b"get /healthz HTTP/1.1"), [400]),
    "unknown method": Odd(get(line=b"BREW /healthz HTTP/1.1"), [400]),
    "TRACE": Odd(get(line=b"TRACE /healthz HTTP/1.1"), [405]),
    "CONNECT": Odd(get(line=b"CONNECT localhost:80 HTTP/1.1"), [400]),
    "CONNECT to a path": Odd(get(line=b"CONNECT /healthz HTTP/1.1"), [405]),
    "target *": Odd(get(line=b"OPTIONS * HTTP/1.1"), [404], [400]),
    "absolute target": Odd(get(line=b"GET http://localhost/healthz HTTP/1.1"), [200]),
    "target without a slash": Odd(get(line=b"GET healthz HTTP/1.1"), [400]),
    "target with two slashes": Odd(get(line=b"GET //healthz HTTP/1.1"), [404]),
    "target with dots": Odd(get(line=b"GET /page/../healthz HTTP/1.1"), [404]),
    "target with encoded dots": Odd(get(line=b"GET /page/%2e%2e/healthz HTTP/1.1"), [404]),
    "target with an encoded NUL": Odd(get(line=b"GET /v1/jobs/%00 HTTP/1.1"), [404], [400]),
    "target in Latin-1": Odd(get(line=b"GET /\xe9 HTTP/1.1"), [400]),
    "target of 100 kB": Odd(get(line=b"GET /" + b"a" * 100_000 + b" HTTP/1.1"), [400], [414]),
    "header of 100 kB": Odd(get(b"X-A: " + b"b" * 100_000 + b"\r\n"), [400]),
    "100,000 headers": Odd(get(b"A:\r\n" * 100_000), [400]),
    "no host": Odd(get(host=b""), [400]),
    "two hosts": Odd(get(host=HOST_LINE + b"Host: evil.example\r\n"), [400]),
    "the same host twice": Odd(get(host=HOST_LINE + HOST_LINE), [400]),
    "empty host": Odd(get(host=b"Host:\r\n"), [421], [400]),
    "another host": Odd(get(host=b"Host: evil.example\r\n"), [421]),
    "body of GET": Odd(get(b"Content-Length: 2\r\n") + b"{}", [200]),
    "expectation": Odd(post(b"Expect: 100-continue\r\nContent-Length: 2\r\n", b"{}"), [100, 422]),
    "offer of HTTP/2": Odd(get(UPGRADE) + get(), [200], [200, 200]),
    "offer of HTTP/2 with a body": Odd(post(UPGRADE + b"Content-Length: 2\r\n", b"{}"), [400], [422]),
    "two requests": Odd(get() + get(), [200, 200]),
    "request after the last one": Odd(get(b"Connection: close\r\n") + get(), [200]),
    "request after garbage": Odd(b"\x00\r\n\r\n" + get(), [400]),
}


def statuses(port: int, sent: bytes, expected: int) -> list[int]:
    """Return the statuses of all answers, without that to a last request if the connection is open after `expected`."""
    with socket.create_connection((HOST, port), timeout=HANG_S) as line:
        found = b""
        with suppress(ConnectionResetError, BrokenPipeError):
            line.sendall(sent)
            asked = False
            while True:
                if not asked and _is_open(found, expected):
                    asked = True
                    line.sendall(get(b"Connection: close\r\n", line=b"GET /last HTTP/1.1"))
                if not (data := line.recv(65536)):
                    break
                found += data
    codes = [int(code) for code in re.findall(rb"HTTP/1\.[01] (\d{3}) ", found)]
    return codes[:-1] if asked and codes and codes[-1] == 404 else codes


def _is_open(found: bytes, expected: int) -> bool:
    """Return whether so many answers have arrived, the last one whole, and none closes the connection."""
    answers = re.split(rb"(?=HTTP/1\.[01] \d{3} )", found)[1:]
    if len(answers) < expected or re.search(rb"\r\nconnection: close\r\n", found, re.IGNORECASE):
        return False
    head, end, body = answers[-1].partition(b"\r\n\r\n")
    length = re.search(rb"\r\ncontent-length: (\d+)", head, re.IGNORECASE)
    return bool(end) and (length is None or len(body) >= int(length[1]))
