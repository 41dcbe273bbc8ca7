"""Maps as they are uploaded for simulations."""

import base64
import io
from typing import Any

from PIL import Image

YAML = "image: room.png\nresolution: 0.25\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.25\n"


def room(size: tuple[int, int] = (40, 30), free: int = 254) -> Image.Image:
    """Return the image of a room with walls of two pixels."""
    image = Image.new("L", size, 0)
    image.paste(free, (2, 2, size[0] - 2, size[1] - 2))
    return image


def picture(size: tuple[int, int] = (40, 30), free: int = 254, form: str = "PNG") -> str:
    """Return the image of a room in base64."""
    buffer = io.BytesIO()
    room(size, free).save(buffer, form)
    return base64.b64encode(buffer.getvalue()).decode()


def on_map(yaml: str = YAML, image: str | None = None, coarser: int = 1, **more: Any) -> dict[str, Any]:
    """Return the body of a request for a simulation on an uploaded map."""
    uploaded = {"name": "room", "yaml": yaml, "image_base64": image or picture(), "coarser": coarser}
    return {"map": uploaded, "planner": "greedy", "budget": {"steps": 1}, **more}
