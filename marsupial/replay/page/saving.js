/* Mission logs saved as files by the browser. */

import { make } from "#draw/dom.js";

/** The button of a view that saves the logs of so many missions, as `logs` returns them.
    @type {(missions: number, logs: () => NamedLog[] | Promise<NamedLog[]>) => SaveButton} */
export function saveButton(missions, logs) {
  const saveAll = async () => {
    for (const one of await logs()) save(one);
  };
  return [missions > 1 ? "Save logs" : "Save log", saveAll];
}

/** @type {(log: NamedLog) => void} */
function save({ text, name }) {
  const address = URL.createObjectURL(new Blob([text], { type: "application/jsonl" }));
  make("a", { href: address, download: `${name.replace(/[^\w.-]+/g, "-") || "mission"}.jsonl` }).click();
  setTimeout(() => URL.revokeObjectURL(address), 10000);
}
