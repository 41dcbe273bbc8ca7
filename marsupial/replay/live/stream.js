/* Streams of events, read to their end whatever breaks on the way: each is taken up after the last event that came.

   Read by fetch and not by EventSource, which can't send the header with the key. */

import { messageOf, Refused, send } from "#live/service.js";

const FIRST_PAUSE_MS = 250;
const LONGEST_PAUSE_MS = 4000;
const SILENCE_MS = 40000; // the service sends something every 15 s, if only that it is still there

/** What can't be read at the moment.
    @type {Set<object>} */
const broken = new Set();
/** Who is called when that begins or ends.
    @type {Set<(isBroken: boolean | null) => void>} */
const watchers = new Set();

/** Have `watcher` called: with true when something can't be read, with false when all can again, with null if nothing
    is read any more that can't.
    @type {(watcher: (isBroken: boolean | null) => void) => void} */
export function watchConnection(watcher) {
  watchers.add(watcher);
}

/** Note that what `reader` reads from the service is broken, or is not.
    @type {(reader: object, isBroken: boolean) => void} */
export function mark(reader, isBroken) {
  const before = broken.size > 0;
  if (isBroken) broken.add(reader);
  else broken.delete(reader);
  if (before !== broken.size > 0) for (const watcher of watchers) watcher(broken.size > 0);
}

/** Note that it reads no more.
    @type {(reader: object) => void} */
export function forget(reader) {
  if (broken.delete(reader) && broken.size === 0) for (const watcher of watchers) watcher(null);
}

/** @type {(ms: number) => Promise<void>} */
export function pause(ms) {
  return new Promise((resolve) => {
    setTimeout(resolve, ms);
  });
}

export class Stream {
  /** @param {string} path
      @param {(event: StreamEvent) => void} take gets each event, data as text
      @param {(reason: string) => void} over is called once nothing more comes */
  constructor(path, take, over = () => {}) {
    this.path = path;
    this.take = take;
    this.over = over;
    this.last = 0; // number of the last event
    this.pauseMs = FIRST_PAUSE_MS;
    this.closed = false;
    this.ended = false;
    this.aborter = new AbortController();
    this.run();
  }

  /** Read no more. */
  close() {
    this.closed = true;
    this.aborter.abort();
    forget(this);
  }

  async run() {
    while (!this.closed && !this.ended) {
      try {
        await this.read();
      } catch (error) {
        if (this.closed) return;
        if (error instanceof Refused) {
          mark(this, false);
          this.over(messageOf(error));
          return;
        }
      }
      if (this.closed || this.ended) break;
      mark(this, true);
      await pause(this.pauseMs);
      this.pauseMs = Math.min(LONGEST_PAUSE_MS, 1.6 * this.pauseMs);
    }
    mark(this, false);
    if (!this.closed) this.over("");
  }

  /** Read until the connection ends. Throws Refused where it is of no use to try again. */
  async read() {
    /** @type {Record<string, string>} */
    const headers = { Accept: "text/event-stream" };
    if (this.last) headers["Last-Event-ID"] = String(this.last);
    this.aborter = new AbortController();
    const response = await send(this.path, { headers, signal: this.aborter.signal });
    if (response.status === 204) {
      this.ended = true;
      return;
    }
    if (response.status >= 400 && response.status < 500 && response.status !== 429) {
      throw new Refused(response.status, await response.json());
    }
    if (!response.ok || !response.body) return;
    mark(this, false);
    await this.readBody(response.body.pipeThrough(new TextDecoderStream()).getReader());
  }

  /** @type {(reader: ReadableStreamDefaultReader<string>) => Promise<void>} */
  async readBody(reader) {
    let rest = "";
    while (!this.ended) {
      const silence = setTimeout(() => this.aborter.abort(), SILENCE_MS);
      const { done, value } = await reader.read().finally(() => clearTimeout(silence));
      if (done) return;
      this.pauseMs = FIRST_PAUSE_MS;
      const frames = (rest + value).split("\n\n");
      rest = frames.pop() ?? "";
      for (const frame of frames) this.takeFrame(frame);
    }
  }

  /** @type {(frame: string) => void} */
  takeFrame(frame) {
    const fields = new Map();
    for (const line of frame.split("\n")) {
      const at = line.indexOf(": ");
      if (at > 0) fields.set(line.slice(0, at), line.slice(at + 2));
    }
    const id = Number(fields.get("id") ?? 0);
    if (id <= this.last) return;
    const type = fields.get("event") ?? "";
    this.last = id;
    this.ended = type === "end";
    this.take({ id, type, data: fields.get("data") ?? "" });
  }
}
