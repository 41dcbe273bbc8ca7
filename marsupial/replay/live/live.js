/* The page of the service: what to start, what there is, and a mission, some missions or a job as they go on.

   Which of them is seen stands behind the # of the address: `/`, `/missions/ID`, `/missions/ID,ID,...`, `/jobs/ID`. */

import { button, icon, make, nothing } from "#draw/dom.js";
import { EntryList } from "#live/entrylist.js";
import { JobPage } from "#live/jobpage.js";
import { MissionsPage } from "#live/missionspage.js";
import { requestKeysBy, forgetKey, hasKey } from "#live/service.js";
import { StartForm } from "#live/startform.js";
import { watchConnection } from "#live/stream.js";

const MOST = 6; // missions side by side
const BACK_MS = 4000;
const READY_MS = 1000; // pause between questions whether the service plans yet
const HALF_FULL = "M8 1a7 7 0 1 0 0 14A7 7 0 0 0 8 1zm0 1.6v10.8a5.4 5.4 0 0 1 0-10.8z";
const byId = (id) => document.getElementById(id);

/** What stands on every page: the way home, how the connection is, and the dialog for the key. */
function frame() {
  const notice = make("p", { class: "problem", id: "key-notice", role: "alert" }),
    key = make("input", { type: "password", id: "key-text", autocomplete: "off", required: true });
  return [
    make(
      "nav",
      { id: "bar" },
      make("a", { href: "#/", class: "home", text: "marsupial" }),
      make("span", { class: "spring" }),
      make("a", { href: "docs", text: "HTTP interface" }),
      make("button", {
        type: "button",
        id: "leave",
        text: "Forget key",
        title: "Forget the API key of this tab",
        hidden: !hasKey(),
        onclick: () => {
          forgetKey();
          location.reload();
        },
      }),
      button("Light or dark", icon(HALF_FULL), () => setTheme(theme() === "dark" ? "light" : "dark"), { id: "theme" }),
    ),
    make("div", { id: "content" }),
    make("p", { id: "connection", role: "status" }),
    make(
      "dialog",
      { id: "key", "aria-labelledby": "key-title", oncancel: (event) => event.preventDefault() },
      make(
        "form",
        { method: "dialog" },
        make("h2", { id: "key-title", text: "This service asks for an API key" }),
        notice,
        make("label", { for: "key-text" }, "Key", key),
        make("p", { class: "dim", text: "It is kept in this tab only." }),
        make("button", { class: "first", text: "Go on" }),
      ),
    ),
  ];
}

class HomePage {
  constructor() {
    const form = new StartForm((missions) => {
      location.hash = `/missions/${missions.map((one) => one.id).join(",")}`;
    });
    this.lists = [new EntryList("missions"), new EntryList("jobs")];
    this.element = make(
      "main",
      { class: "home" },
      form.element,
      make("div", { class: "lists" }, form.preview.element, ...this.lists.map((list) => list.element)),
    );
    this.form = form;
  }

  close() {
    for (const one of [this.form, ...this.lists]) one.close();
  }
}

const PAGES = [
  [
    /^\/missions\/([^/,][^/]*)$/,
    (ids) => new MissionsPage([...new Set(ids.split(",").filter(Boolean))].slice(0, MOST)),
  ],
  [/^\/jobs\/([^/]+)$/, (id) => new JobPage(id)],
  [/^\/?$/, () => new HomePage()],
  [/^/, () => ({ element: nothing("There is no page at this address."), close() {} })],
];

let page = null;

function open() {
  page?.close();
  const [path] = location.hash.slice(1).split("&");
  for (const [pattern, of] of PAGES) {
    const found = pattern.exec(path);
    if (!found) continue;
    page = of(found[1] && decoded(found[1]));
    break;
  }
  byId("content").replaceChildren(page.element);
  page.begin?.();
  window.scrollTo(0, 0);
}

/** A part of an address as it was meant; as it stands, if it is badly encoded. */
function decoded(part) {
  try {
    return decodeURIComponent(part);
  } catch {
    return part;
  }
}

/** Show the dialog until there is something in it. */
function requestKey(reason) {
  const dialog = byId("key"),
    text = byId("key-text");
  byId("key-notice").textContent = reason;
  text.value = "";
  return new Promise((resolve) => {
    dialog.addEventListener(
      "close",
      () => {
        resolve(text.value.trim());
        byId("leave").hidden = false;
      },
      { once: true },
    );
    if (!dialog.open) dialog.showModal();
  });
}

/** Show that the connection is lost, or back; null: that nobody waits for it any more. */
function showConnection(isBroken) {
  const line = byId("connection");
  line.className = isBroken ? "lost" : "back";
  line.textContent = isBroken === null ? "" : isBroken ? "connection lost, trying again" : "back";
  if (isBroken) return;
  setTimeout(() => {
    if (line.className !== "back") return;
    line.textContent = "";
    showReadiness();
  }, BACK_MS);
}

let polling = false;

/** Show why the service does not plan yet, until it does. */
async function showReadiness() {
  if (polling) return;
  polling = true;
  const line = byId("connection");
  for (;;) {
    const response = await fetch("readyz", { cache: "no-store" }).catch(() => null);
    if (response?.status !== 503) break;
    const { detail } = await response.json().catch(() => ({}));
    if (detail && line.className !== "lost") {
      Object.assign(line, { className: "starting", textContent: `no plans yet: ${detail}` });
    }
    await new Promise((resolve) => {
      setTimeout(resolve, READY_MS);
    });
  }
  polling = false;
  if (line.className === "starting") line.textContent = "";
}

function theme() {
  return document.documentElement.dataset.theme;
}

function setTheme(name) {
  document.documentElement.dataset.theme = name;
  window.dispatchEvent(new Event("themechange"));
}

byId("app").replaceChildren(...frame());
requestKeysBy(requestKey);
watchConnection(showConnection);
showReadiness();
const dark = matchMedia("(prefers-color-scheme: dark)");
setTheme(dark.matches ? "dark" : "light");
dark.addEventListener("change", () => setTheme(dark.matches ? "dark" : "light"));
window.addEventListener("hashchange", open);
open();
