/* Mission logs saved as files of the one who looks at them. */

import { make } from "#draw/dom.js";

/** The button of a view that saves the logs of so many missions: `texts()` gives `[{text, name}]`, or a promise of it. */
export function saveButton(missions, texts) {
  return [
    missions > 1 ? "Save logs" : "Save log",
    async () => {
      for (const one of await texts()) save(one);
    },
  ];
}

function save({ text, name }) {
  const address = URL.createObjectURL(new Blob([text], { type: "application/jsonl" }));
  make("a", { href: address, download: `${name.replace(/[^\w.-]+/g, "-") || "mission"}.jsonl` }).click();
  setTimeout(() => URL.revokeObjectURL(address), 10000);
}
