"""Use the page of the service in a browser."""

from typing import Any

from support.pictures.browser import Browser

PRESS = """
const [selector, x, y] = arguments, canvas = document.querySelector(selector), box = canvas.getBoundingClientRect();
const at = { clientX: box.left + x * box.width, clientY: box.top + y * box.height, pointerId: 1 };
for (const kind of ["pointerdown", "pointerup"]) canvas.dispatchEvent(new PointerEvent(kind, { ...at, bubbles: true }));
"""
"""Click on a canvas, at shares of its width and height."""


def choose(browser: Browser, **values: Any) -> None:
    """Fill in fields of the form by name."""
    browser.find("form.start details.more")
    browser.run("document.querySelector('form.start details.more').open = true")
    for name, value in values.items():
        field = browser.find(f"#start-{name}")
        browser.run(
            "arguments[0].value = arguments[1]; for (const kind of ['input', 'change'])"
            " arguments[0].dispatchEvent(new Event(kind, { bubbles: true }))",
            field,
            str(value),
        )
