/* The small card beside the pointer. */

import { make } from "#draw/dom.js";

export class Tip {
  constructor() {
    this.element = make("div", { class: "tip", role: "tooltip", hidden: true });
    this.text = "";
  }

  /** Show a story (a title and lines) at the pointer; nothing for null. */
  show(event, story) {
    if (!story || event.pointerType === "touch") {
      this.hide();
      return;
    }
    const text = [story.title, ...story.lines].join("\n"),
      { element } = this;
    if (text !== this.text) {
      element.replaceChildren(
        make("b", { text: story.title }),
        ...story.lines.map((line) => make("p", { text: line })),
      );
    }
    this.text = text;
    element.hidden = false;
    element.style.left = `${Math.max(4, Math.min(event.clientX + 14, innerWidth - element.offsetWidth - 8))}px`;
    const below = event.clientY + 16,
      over = below + element.offsetHeight > innerHeight - 4;
    element.style.top = `${over ? Math.max(4, event.clientY - element.offsetHeight - 12) : below}px`;
  }

  hide() {
    this.element.hidden = true;
  }
}
