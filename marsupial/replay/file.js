/* A replay file: the logs stand in the page, packed, and are played from there. */

import { show } from "./app.js";
import { readMission } from "./model.js";
import { saveButton } from "./saving.js";

/** The text of a log that stands in the page, as bytes packed by gzip and written in base 64. */
async function unpacked(element) {
  const bytes = Uint8Array.from(atob(element.textContent.trim()), (letter) => letter.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
}

async function open() {
  const texts = await Promise.all([...document.querySelectorAll("script.log")].map(unpacked));
  const missions = texts.map(readMission), named = texts.map((text, i) => ({ text, name: `${missions[i].start.scenario}-${missions[i].start.strategy}` }));
  show(document.getElementById("app"), missions, { save: saveButton(texts.length, () => named) });
}

open();
