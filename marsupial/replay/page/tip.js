/* The small card beside the pointer. */

import { make } from "#draw/dom.js";

export class Tip {
  constructor() {
    this.element = make("div", { class: "tip", role: "tooltip", hidden: true });
    this.text = "";
  }

  /** Show a story at the pointer, or above a height of the window that it shall not lie below; nothing for null.
      @type {(event: PointerEvent, story: Story | null, lowest?: number) => void} */
  show(event, story, lowest) {
    if (!story || event.pointerType === "touch") {
      this.hide();
      return;
    }
    const { element } = this;
    const text = [story.title, ...story.lines].join("\n");
    if (text !== this.text) {
      const lines = story.lines.map((line) => make("p", { text: line }));
      element.replaceChildren(make("b", { text: story.title }), ...lines);
    }
    this.text = text;
    element.hidden = false;
    const left = Math.max(4, Math.min(event.clientX + 14, innerWidth - element.offsetWidth - 8));
    const below = event.clientY + 16;
    const isLow = lowest !== undefined || below + element.offsetHeight > innerHeight - 4;
    const above = Math.max(4, (lowest ?? event.clientY - 12) - element.offsetHeight);
    element.style.left = `${left}px`;
    element.style.top = `${isLow ? above : below}px`;
  }

  hide() {
    this.element.hidden = true;
  }
}
