"""Changes of valid inputs that preserve enough structure to get deep into a reader.

libFuzzer changes bytes; here words, numbers, brackets, fields of JSON and chunks of PNG are changed.
"""

from __future__ import annotations

import json
import random
import re
import struct
import zlib
from collections.abc import Callable, Iterator, Sequence
from typing import Any

PNG = b"\x89PNG\r\n\x1a\n"

_TOKEN = re.compile(rb"[A-Za-z_]+|[-+.\d]+|\s+|.", re.DOTALL)

WINDOW = 128
"""Bytes of an input in which one change of words is made."""

ODD_WORDS = (
    b"", b"0", b"-1", b"1.5", b"-0.0", b"1e999", b"-1e999", b"1e-400", b"1e308", b"9223372036854775808", b"9" * 5000,
    b"0x7f", b"nan", b".inf", b"NaN", b"Infinity", b"null", b"~", b"true", b"[]", b"{}", b'""', b"''", b"\0",
    b"\xff", b"\xef\xbb\xbf", b"\xed\xa0\x80", b'"\\ud800"', b"\xc2\xb2", b"\xe2\x80\xa8", b"\r", b"\x1b[2J",
    b"/dev/zero", b"..", b"*a", b"&a ", b"!!int ", b"!!timestamp ", b"2001-99-99", b"? ", b"<<: ", b"- ",
    b"(" * 3000, b"[" * 3000, b'{"a":' * 3000,
)  # fmt: skip
"""Numbers, texts and brackets that are rare in tests."""

ODD_VALUES: tuple[object, ...] = (
    None, True, False, 0, -1, 1, 255, 256, 1.5, 1e308, -1e308, 10**19, 10**400, "", "a", "\ud800", "\0", "a" * 300,
    "x\u2028y", [], {}, [[]], [None], {"": None}, [0] * 40, float("inf"), float("nan"),
)  # fmt: skip


def mutated(data: bytes, rng: random.Random, words: Sequence[bytes]) -> bytes:
    """Return `data` with one change or a few; `words` belong to its format."""
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        change = rng.choice((_in_json, _in_json, _in_words, _in_words, _in_bytes))
        data = change(data, rng, words)
    return _with_right_sums(data) if data.startswith(PNG) else data


def mutations(seeds: Sequence[bytes], count: int, words: Sequence[bytes], seed: int = 1) -> Iterator[bytes]:
    """Yield the same `count` changes of the seeds every time."""
    rng = random.Random(seed)
    for i in range(count):
        yield mutated(seeds[i % len(seeds)], rng, words)


def _in_bytes(data: bytes, rng: random.Random, words: Sequence[bytes]) -> bytes:
    at, end = sorted((rng.randrange(len(data) + 1), rng.randrange(len(data) + 1)))
    end = min(end, at + rng.choice((1, 1, 4, 64, 4096)))
    some = rng.choice((b"", bytes([rng.randrange(256)]), rng.randbytes(end - at), 2 * data[at:end]))
    return data[:at] + some + data[end:]


def _in_words(data: bytes, rng: random.Random, words: Sequence[bytes]) -> bytes:
    (start, tokens), (_, others) = _tokens(data, rng), _tokens(data, rng)
    at = rng.randrange(len(tokens))
    end = min(len(tokens), at + rng.choice((1, 1, 1, 2, 8, 64)))
    some = rng.choice((b"", rng.choice(others), rng.choice(ODD_WORDS), rng.choice((*words, b"1")), 2 * tokens[at]))
    if rng.random() < 0.2:  # beside it, not in its place
        end = at
    return b"".join((data[:start], *tokens[:at], some, *tokens[end:], data[start + WINDOW :]))


def _tokens(data: bytes, rng: random.Random) -> tuple[int, list[bytes]]:
    """Return where a window of `data` begins, and its tokens: those of all data would take longer than many readers."""
    start = rng.randrange(max(1, len(data) - WINDOW + 1))
    return start, _TOKEN.findall(data, start, start + WINDOW) or [b""]


def _in_json(data: bytes, rng: random.Random, words: Sequence[bytes]) -> bytes:
    """Change a value of a JSON text, or of one line of it if each line is one; other texts have their words changed."""
    lines = data.splitlines(keepends=True) if data.startswith(b"{") and b"}\n{" in data else [data]
    at = rng.randrange(len(lines))
    try:
        value = json.loads(lines[at])
        places = _places(value)
        (inside, key), (other, name) = rng.choice(places), rng.choice(places)
        _change(inside, key, rng, other[name])
        text = json.dumps(value, ensure_ascii=rng.random() < 0.5).encode(errors="surrogatepass")
    except (
        ValueError,
        OverflowError,
        IndexError,
        RecursionError,
    ):  # no JSON, without parts, or with too large a number
        return _in_words(data, rng, words)
    lines[at] = text + (b"\n" if lines[at].endswith(b"\n") else b"")
    return b"".join(lines)


def _places(value: Any) -> list[tuple[Any, Any]]:
    """Return each list and mapping inside a value with each of its indices and keys."""
    found: list[tuple[Any, Any]] = []
    waiting = [value]
    for inside in waiting:
        keys: Any = inside if isinstance(inside, dict) else range(len(inside)) if isinstance(inside, list) else ()
        for key in keys:
            found.append((inside, key))
            waiting.append(inside[key])
    return found


def _change(inside: Any, key: Any, rng: random.Random, other: Any) -> None:
    ways: list[Callable[[], Any]] = [
        lambda: inside.__setitem__(key, rng.choice(ODD_VALUES)),
        lambda: inside.__setitem__(key, json.loads(json.dumps(other))),
        lambda: inside.__delitem__(key),
        lambda: inside.update({f"{key}x": inside[key]}) if isinstance(inside, dict) else inside.append(inside[key]),
    ]
    if isinstance(inside[key], int | float):
        ways += 3 * [lambda: inside.__setitem__(key, inside[key] * rng.choice((-1, 0, 2, 0.5, 1000, 1e300)))]
    rng.choice(ways)()


def _with_right_sums(png: bytes) -> bytes:
    """Return a PNG whose chunks have correct checksums; a decoder stops at a wrong one."""
    at, parts = len(PNG), [PNG]
    while at + 12 <= len(png):
        (length,) = struct.unpack(">I", png[at : at + 4])
        chunk = png[at + 4 : at + 8 + length]
        if len(chunk) < 4 + length:
            break
        parts += [png[at : at + 4], chunk, struct.pack(">I", zlib.crc32(chunk))]
        at += 12 + length
    return b"".join((*parts, png[at:]))
