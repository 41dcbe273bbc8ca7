/* The page of the service: what to start, what there is, and a mission, some missions or a job as they go on.

   Which of them is seen stands behind the # of the address: `/`, `/missions/ID`, `/missions/ID,ID,...`, `/jobs/ID`. */

import { button, icon, make, nothing } from "#draw/dom.js";
import { JobList, MissionList } from "#live/entrylist.js";
import { JobPage } from "#live/jobpage.js";
import { MissionsPage } from "#live/missionspage.js";
import { forgetKey, hasKey, requestKeysBy } from "#live/service.js";
import { StartForm } from "#live/startform.js";
import { pause, watchConnection } from "#live/stream.js";
import { HALF_FULL } from "#page/header.js";

const MOST = 6; // missions side by side
const BACK_MS = 4000;
const READY_MS = 1000; // pause between questions whether the service plans yet

const content = make("div", { id: "content" });
const connection = make("p", { id: "connection", role: "status" });
const forgetButton = make("button", {
  type: "button",
  id: "leave",
  text: "Forget key",
  title: "Forget the API key of this tab",
  hidden: !hasKey(),
  onclick: () => {
    forgetKey();
    location.reload();
  },
});
const keyNotice = make("p", { class: "problem", id: "key-notice", role: "alert" });
const keyText = make("input", { type: "password", id: "key-text", autocomplete: "off", required: true });
const keyDialog = make(
  "dialog",
  { id: "key", "aria-labelledby": "key-title", oncancel: (event) => event.preventDefault() },
  make(
    "form",
    { method: "dialog" },
    make("h2", { id: "key-title", text: "This service asks for an API key" }),
    keyNotice,
    make("label", { for: "key-text" }, "Key", keyText),
    make("p", { class: "dim", text: "It is kept in this tab only." }),
    make("button", { class: "first", text: "Go on" }),
  ),
);

/** What stands on every page: the way home, how the connection is, and the dialog for the key. */
function frame() {
  const bar = make(
    "nav",
    { id: "bar" },
    make("a", { href: "#/", class: "home", text: "marsupial" }),
    make("span", { class: "spring" }),
    make("a", { href: "docs", text: "HTTP interface" }),
    forgetButton,
    button("Light or dark", icon(HALF_FULL), () => setTheme(theme() === "dark" ? "light" : "dark"), { id: "theme" }),
  );
  return [bar, content, connection, keyDialog];
}

class HomePage {
  constructor() {
    this.form = new StartForm((missions) => {
      location.hash = `/missions/${missions.map((one) => one.id).join(",")}`;
    });
    this.lists = [new MissionList(), new JobList()];
    const lists = this.lists.map((list) => list.element);
    this.element = make(
      "main",
      { class: "home" },
      this.form.element,
      make("div", { class: "lists" }, this.form.preview.element, ...lists),
    );
  }

  close() {
    for (const one of [this.form, ...this.lists]) one.close();
  }
}

/** The page of an address.
    @type {(path: string) => LivePage} */
function pageOf(path) {
  const missions = /^\/missions\/([^/,][^/]*)$/.exec(path);
  if (missions) return new MissionsPage([...new Set(decoded(missions[1]).split(",").filter(Boolean))].slice(0, MOST));
  const job = /^\/jobs\/([^/]+)$/.exec(path);
  if (job) return new JobPage(decoded(job[1]));
  if (path === "" || path === "/") return new HomePage();
  return { element: nothing("There is no page at this address."), close: () => {} };
}

/** @type {LivePage | null} */
let page = null;

function open() {
  page?.close();
  page = pageOf(location.hash.slice(1).split("&")[0]);
  content.replaceChildren(page.element);
  page.begin?.();
  window.scrollTo(0, 0);
}

/** A part of an address as it was meant; as it stands, if it is badly encoded.
    @type {(part: string) => string} */
function decoded(part) {
  try {
    return decodeURIComponent(part);
  } catch {
    return part;
  }
}

/** Show the dialog until there is something in it.
    @type {(reason: string) => Promise<string>} */
function requestKey(reason) {
  keyNotice.textContent = reason;
  keyText.value = "";
  return new Promise((resolve) => {
    const closed = () => {
      resolve(keyText.value.trim());
      forgetButton.hidden = false;
    };
    keyDialog.addEventListener("close", closed, { once: true });
    if (!keyDialog.open) keyDialog.showModal();
  });
}

/** Show that the connection is lost, or back; null: that nobody waits for it any more.
    @type {(isBroken: boolean | null) => Promise<void>} */
async function showConnection(isBroken) {
  connection.className = isBroken ? "lost" : "back";
  connection.textContent = isBroken ? "connection lost, trying again" : isBroken === null ? "" : "back";
  if (isBroken) return;
  await pause(BACK_MS);
  if (connection.className !== "back") return;
  connection.textContent = "";
  showReadiness();
}

let polling = false;

/** Show why the service does not plan yet, until it does. */
async function showReadiness() {
  if (polling) return;
  polling = true;
  for (;;) {
    const response = await fetch("readyz", { cache: "no-store" }).catch(() => null);
    if (response?.status !== 503) break;
    const { detail } = await response.json().catch(() => ({}));
    if (detail && connection.className !== "lost") {
      connection.className = "starting";
      connection.textContent = `no plans yet: ${detail}`;
    }
    await pause(READY_MS);
  }
  polling = false;
  if (connection.className === "starting") connection.textContent = "";
}

function theme() {
  return document.documentElement.dataset.theme;
}

/** @type {(name: string) => void} */
function setTheme(name) {
  document.documentElement.dataset.theme = name;
  window.dispatchEvent(new Event("themechange"));
}

document.querySelector("#app")?.replaceChildren(...frame());
requestKeysBy(requestKey);
watchConnection(showConnection);
showReadiness();
const dark = matchMedia("(prefers-color-scheme: dark)");
setTheme(dark.matches ? "dark" : "light");
dark.addEventListener("change", () => setTheme(dark.matches ? "dark" : "light"));
window.addEventListener("hashchange", open);
open();
