"""Colour differences for normal vision and for each kind of colour blindness.

References
----------
G. M. Machado, M. M. Oliveira, L. A. F. Fernandes: A physiologically-based model for simulation of color vision
deficiency, IEEE TVCG 15(6), 2009.
"""

import numpy as np
import numpy.typing as npt
from skimage.color import deltaE_ciede2000, rgb2lab

Colours = npt.NDArray[np.float64]

# Machado, Oliveira and Fernandes 2009, severity 1.0: linear RGB as seen without one kind of cones.
SIGHT = {
    "all cones": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "tritanopia": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]
    ),
}


def linear(colours: list[str]) -> Colours:
    """Return linear RGB, (colours, 3), of ``#rrggbb``."""
    values = np.array([[int(colour[i : i + 2], 16) for i in (1, 3, 5)] for colour in colours]) / 255
    return np.asarray(np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4))


def seen(colours: list[str], sight: str) -> Colours:
    """Return the CIELAB values, (colours, 3), of colours as seen with this colour vision."""
    light = np.clip(linear(colours) @ SIGHT[sight].T, 0, 1)
    return np.asarray(rgb2lab(np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)))


def nearest(colours: list[str], others: list[str] | None = None) -> float:
    """Return the least CIEDE2000 distance between `colours`, or from these to `others`, over all kinds of vision."""
    found = []
    for sight in SIGHT:
        distances = deltaE_ciede2000(seen(colours, sight)[:, None], seen(others or colours, sight)[None])
        if others is None:
            distances = distances[np.triu_indices(len(colours), 1)]
        found.append(float(distances.min()))
    return min(found)


def contrast(one: str, other: str) -> float:
    """Return the contrast ratio of WCAG 2."""
    low, high = sorted(linear([one, other]) @ [0.2126, 0.7152, 0.0722])
    return float((high + 0.05) / (low + 0.05))
