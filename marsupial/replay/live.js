/* The page of the service: what to start, what there is, and a mission, two missions or a job as they go on.

   Which of them is seen stands behind the # of the address: `/`, `/missions/ID`, `/missions/ID,ID`, `/jobs/ID`. */

import { make } from "./dom.js";
import { EntryList } from "./entrylist.js";
import { JobPage } from "./jobpage.js";
import { MissionsPage } from "./missionspage.js";
import { askKeysBy, forgetKey, hasKey } from "./service.js";
import { StartForm } from "./startform.js";
import { watchConnection } from "./stream.js";

const BACK_MS = 4000;
const byId = (id) => document.getElementById(id);

class HomePage {
  constructor() {
    const form = new StartForm((missions) => { location.hash = `/missions/${missions.map((one) => one.id).join(",")}`; });
    this.lists = [new EntryList("missions"), new EntryList("jobs")];
    this.element = make("main", { class: "home" }, form.element, make("div", { class: "lists" }, ...this.lists.map((list) => list.element)));
    this.title = "";
  }

  close() { for (const list of this.lists) list.close(); }
}

const PAGES = [
  [/^\/missions\/([\w,]+)$/, (ids) => new MissionsPage(ids.split(",").slice(0, 2))],
  [/^\/jobs\/(\w+)$/, (id) => new JobPage(id)],
  [/^/, () => new HomePage()],
];

let page = null;

function open() {
  page?.close();
  const path = decodeURIComponent(location.hash.slice(1)).split("?")[0];
  for (const [pattern, make] of PAGES) {
    const found = pattern.exec(path);
    if (!found) continue;
    page = make(found[1]);
    break;
  }
  byId("content").replaceChildren(page.element);
  byId("trail").textContent = page.title;
  page.begin?.();
  window.scrollTo(0, 0);
}

/** Show the dialog until there is something in it. */
function askKey(said) {
  const dialog = byId("key"), text = byId("key-text");
  byId("key-said").textContent = said;
  text.value = "";
  return new Promise((resolve) => {
    dialog.addEventListener("cancel", (event) => event.preventDefault());
    dialog.addEventListener("close", () => { resolve(text.value.trim()); byId("leave").hidden = false; }, { once: true });
    if (!dialog.open) dialog.showModal();
  });
}

function tellConnection(isBroken) {
  const told = byId("connection");
  told.className = isBroken ? "lost" : "back";
  told.textContent = isBroken ? "connection lost, trying again" : "back";
  if (!isBroken) setTimeout(() => { if (told.className === "back") told.textContent = ""; }, BACK_MS);
}

function setTheme(theme) { document.documentElement.dataset.theme = theme; window.dispatchEvent(new Event("themechange")); }

askKeysBy(askKey);
watchConnection(tellConnection);
byId("leave").hidden = !hasKey();
byId("leave").addEventListener("click", () => { forgetKey(); location.reload(); });
const dark = matchMedia("(prefers-color-scheme: dark)");
setTheme(dark.matches ? "dark" : "light");
dark.addEventListener("change", () => setTheme(dark.matches ? "dark" : "light"));
byId("theme").addEventListener("click", () => setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"));
window.addEventListener("hashchange", open);
open();
