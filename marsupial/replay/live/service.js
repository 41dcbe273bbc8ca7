/* Requests to the service that the page came from. A key that it needs is kept for this tab only. */

const KEPT = "marsupial-key";

/** The service refused a request: `errors` have the place and the reason. */
export class Refused extends Error {
  /** @param {number} status
      @param {Problem} problem */
  constructor(status, problem) {
    super(problem.detail || problem.title || `the service answered ${status}`);
    this.status = status;
    this.errors = problem.errors || [];
  }
}

/** The service could not be reached. */
export class Unreachable extends Error {}

/** The text of an error that was caught.
    @type {(error: unknown) => string} */
export function messageOf(error) {
  return error instanceof Error ? error.message : String(error);
}

/** The problems that an error stands for.
    @type {(error: unknown) => FieldProblem[]} */
export function problemsOf(error) {
  return error instanceof Refused && error.errors.length ? error.errors : [{ detail: messageOf(error) }];
}

/** Requests a key from the user, with the reason; set by the page.
    @type {(reason: string) => Promise<string>} */
let requestKey = () => Promise.reject(new Error("a key is needed"));
/** @type {Promise<void> | null} */
let pending = null;

/** @type {(request: (reason: string) => Promise<string>) => void} */
export function requestKeysBy(request) {
  requestKey = request;
}

/** Whether requests carry a key. */
export function hasKey() {
  return sessionStorage.getItem(KEPT) !== null;
}

export function forgetKey() {
  sessionStorage.removeItem(KEPT);
}

/** Request a key, once for all requests that need one.
    @type {(reason: string) => Promise<void>} */
async function renewKey(reason) {
  pending ??= requestKey(reason)
    .then((key) => sessionStorage.setItem(KEPT, key))
    .finally(() => {
      pending = null;
    });
  await pending;
}

/** @typedef {{
      method?: string, body?: unknown, headers?: Record<string, string>, signal?: AbortSignal }} RequestOptions */

/** Send a request, again with a key where one is needed. Throws Unreachable.
    @type {(path: string, options?: RequestOptions) => Promise<Response>} */
export async function send(path, { method = "GET", body, headers = {}, signal } = {}) {
  for (;;) {
    const key = sessionStorage.getItem(KEPT);
    const all = { ...headers };
    if (key !== null) all.Authorization = `Bearer ${key}`;
    if (body !== undefined) all["Content-Type"] = "application/json";
    const text = body === undefined ? undefined : JSON.stringify(body);
    let response;
    try {
      response = await fetch(path, { method, headers: all, signal, body: text, cache: "no-store" });
    } catch (error) {
      if (signal?.aborted) throw error;
      throw new Unreachable("the service can't be reached", { cause: error });
    }
    if (response.status !== 401) return response;
    if (key === sessionStorage.getItem(KEPT)) {
      const { detail } = await response.json();
      await renewKey(key === null ? "" : detail);
    }
  }
}

/** @type {(path: string, options?: RequestOptions) => Promise<Response>} */
async function checked(path, options) {
  const response = await send(path, options);
  if (!response.ok) throw new Refused(response.status, await response.json().catch(() => ({})));
  return response;
}

/** Return the document at a path. Throws Refused, Unreachable.
    @template T
    @param {string} path
    @returns {Promise<T>} */
export async function get(path) {
  return (await checked(path)).json();
}

/** Return the text at a path.
    @type {(path: string) => Promise<string>} */
export async function getText(path) {
  return (await checked(path)).text();
}

/** Send a document to a path, where it stands from now on, and return the one that is answered.
    @template T
    @param {string} path
    @param {unknown} body
    @returns {Promise<T>} */
export async function put(path, body) {
  return (await checked(path, { method: "PUT", body })).json();
}

/** Remove what is at a path, and return the document that is answered.
    @template T
    @param {string} path
    @returns {Promise<T>} */
export async function remove(path) {
  return (await checked(path, { method: "DELETE" })).json();
}

/** Send a document and return the one that is answered; `once`: a key by which it is done once, however often sent.
    @template T
    @param {string} path
    @param {unknown} [body]
    @param {string} [once]
    @returns {Promise<T>} */
export async function post(path, body, once) {
  /** @type {Record<string, string>} */
  const headers = once ? { "Idempotency-Key": once } : {};
  return (await checked(path, { method: "POST", body, headers })).json();
}
