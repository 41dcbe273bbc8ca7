"""The Voronoi graph, the critical points and the segments of a partly known map as a figure.

References
----------
Wurm, Stachniss, Burgard: Coordinated Multi-Robot Exploration using a Segmentation of the Environment, IROS 2008,
Figs. 2 and 3.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    pass

GOLDEN = 0.618034
"""Step of the hue from a segment to the next: any few in a row differ well."""

MARGIN_M = 0.5
"""What is shown around the known map."""
