"""Figures as files, with the same bytes for the same figure."""

import io
from typing import Any

from matplotlib.figure import Figure

from marsupial.exports.style import plain_style

SAME_BYTES: dict[str, dict[str, Any]] = {
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
    "png": {"Software": None},
}
"""The metadata to leave out of each kind of file, so that the same figure has the same bytes."""


def figure_file(figure: Figure, kind: str) -> bytes:
    """Return a figure as a file of a kind in `SAME_BYTES`. An SVG holds its text as text, to be searched and edited."""
    out = io.BytesIO()
    with plain_style({"svg.fonttype": "none", "svg.hashsalt": "marsupial", "pdf.fonttype": 42}):
        figure.savefig(out, format=kind, metadata=SAME_BYTES[kind])
    return out.getvalue()
