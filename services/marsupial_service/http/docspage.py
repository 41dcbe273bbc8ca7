"""The page ``/docs``: the OpenAPI document as one page of plain HTML.

The server renders it, not a viewer in the browser: viewers take megabytes, come from other hosts or must be shipped,
and need scripts and styles that a strict policy forbids. This page has no script and loads nothing.
"""

import base64
import hashlib
import json
import re
from collections.abc import Iterator, Mapping
from html import escape
from typing import Any

_STYLE = """
body{font:15px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#1c2733;background:#fff}
h2{margin-top:2.5rem;border-bottom:1px solid #cfd6de}h3{margin:1.6rem 0 .3rem}code,pre{font:13px/1.45 monospace}
code{overflow-wrap:anywhere}
pre{background:#f3f5f7;padding:.7rem;overflow:auto;max-height:24rem}table{border-collapse:collapse;width:100%}
td,th{text-align:left;vertical-align:top;padding:.2rem .7rem .2rem 0;border-top:1px solid #e4e8ec}
a{color:#1b62b5}.method{font-weight:700}.must{color:#a03311}
@media(prefers-color-scheme:dark){body{color:#dde3ea;background:#14191f}pre{background:#1f262e}a{color:#7db4f0}
.must{color:#f09a7b}h2,td,th{border-color:#333b46}}
"""

_STYLE_HASH = base64.b64encode(hashlib.sha256(_STYLE.encode()).digest()).decode()

HEADERS: Mapping[str, str] = {
    "Content-Security-Policy": f"default-src 'none'; style-src 'sha256-{_STYLE_HASH}'; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'",
    "Cache-Control": "no-store",
}
"""The headers of the page: it may use its own style and nothing else."""

_CODE = re.compile("`{1,2}([^`]+)`{1,2}")

# how many levels of nested schemas are shown
_LEVELS = 4


def page_of(document: Mapping[str, Any]) -> str:
    info = document["info"]
    title = f"{escape(info['title'])} {escape(info['version'])}"
    schemas = document["components"]["schemas"]
    parts = [
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{title}</title>',
        f'<meta name="viewport" content="width=device-width"><style>{_STYLE}</style></head><body><main>',
        f'<h1>{title}</h1><p>{_html(info["description"])}</p>',
        '<p>For programs: <a href="openapi.json">openapi.json</a>.</p><h2>Routes</h2><ul>',
        *(f'<li><a href="#{escape(o["operationId"])}"><code>{m.upper()} {escape(p)}</code></a></li>'
          for p, m, o in _operations(document)),
        "</ul>",
        *(part for path, method, one in _operations(document) for part in _operation(path, method, one)),
        "<h2>Schemas</h2>",
        *(part for name in sorted(schemas) for part in _schema(name, schemas[name])),
        "</main></body></html>",
    ]  # fmt: skip
    return "\n".join(parts)


def _operations(document: Mapping[str, Any]) -> Iterator[tuple[str, str, Mapping[str, Any]]]:
    for path, methods in document["paths"].items():
        for method, operation in methods.items():
            yield path, method, operation


def _operation(path: str, method: str, operation: Mapping[str, Any]) -> Iterator[str]:
    yield f'<h3 id="{escape(operation["operationId"])}"><code><span class="method">{method.upper()}</span> '
    yield f"{escape(path)}</code></h3><p>{_html(operation.get('description', ''))}</p><table>"
    for one in operation.get("parameters", ()):
        name = f"<code>{escape(one['name'])}</code> in {escape(one['in'])}{_required_mark(one.get('required', False))}"
        yield _row(name, _kind(one["schema"]), one.get("description", ""))
    body = operation.get("requestBody")
    if body is not None:
        yield _row(f"body{_required_mark(body.get('required', False))}", _kinds_of(body), "")
    for status, response in operation["responses"].items():
        yield _row(f"response <code>{escape(status)}</code>", _kinds_of(response), response["description"])
    yield "</table>"
    example = next((c["example"] for c in (body or {}).get("content", {}).values() if "example" in c), None)
    if example is not None:
        yield f'<pre tabindex="0">{escape(json.dumps(example, indent=1))}</pre>'


def _kinds_of(part: Mapping[str, Any]) -> str:
    """Return the media types of a body, with the schema of each."""
    parts = []
    for media, content in part.get("content", {}).items():
        kind = _kind(content.get("itemSchema") or content.get("schema", {}))
        parts.append(f"<code>{escape(media)}</code> {kind}")
    return "<br>".join(parts)


def _schema(name: str, schema: Mapping[str, Any]) -> Iterator[str]:
    yield f'<h3 id="{escape(name)}"><code>{escape(name)}</code></h3><p>{_html(schema.get("description", ""))}</p>'
    required = schema.get("required", ())
    if "properties" not in schema:
        yield f"<p>{_kind(schema)}</p>"
        return
    yield "<table>"
    for field, what in schema["properties"].items():
        yield _row(
            f"<code>{escape(field)}</code>{_required_mark(field in required)}", _kind(what), what.get("description", "")
        )
    yield "</table>"


def _row(name: str, kind: str, text: str) -> str:
    return f"<tr><td>{name}</td><td>{kind}</td><td>{_html(text)}</td></tr>"


def _html(text: str) -> str:
    """Return a description as HTML; text between backticks is code."""
    return _CODE.sub(r"<code>\1</code>", escape(text))


def _required_mark(required: bool) -> str:
    return ' <span class="must">required</span>' if required else ""


def _kind(schema: Mapping[str, Any], level: int = 0) -> str:
    """Return what a schema asks for, in a line of HTML."""
    if "$ref" in schema:
        name = escape(schema["$ref"].rpartition("/")[2])
        return f'<a href="#{name}">{name}</a>'
    if "const" in schema:
        return f"<code>{escape(json.dumps(schema['const']))}</code>"
    if "enum" in schema:
        return " or ".join(f"<code>{escape(json.dumps(value))}</code>" for value in schema["enum"])
    variants = schema.get("anyOf") or schema.get("oneOf") or ()
    if variants and "properties" not in schema and level < _LEVELS:
        return " or ".join(_kind(variant, level + 1) for variant in variants)
    data = schema.get("properties", {}).get("data", {})
    if "contentSchema" in data:
        return f"event <code>{escape(schema['title'])}</code>: {_kind(data['contentSchema'], level + 1)}"
    kind = schema.get("type", "anything")
    if kind == "array" and level < _LEVELS:
        return f"list of {_kind(schema.get('items', {}), level + 1)}"
    bounds = {"minimum": "from", "exclusiveMinimum": "above", "maximum": "to", "maxLength": "no longer than"}
    parts = [f"{word} {schema[key]}" for key, word in bounds.items() if key in schema]
    return escape(" ".join([str(kind), *parts]))
