/* Streams of events, read to their end whatever breaks on the way: each is taken up after the last event that came.

   Read by fetch and not by EventSource, which can't send the header with the key. */

import { send } from "#live/service.js";

const FIRST_PAUSE_MS = 250,
  LONGEST_PAUSE_MS = 4000;
const SILENCE_MS = 40000; // the service sends something every 15 s, if only that it is still there

/** What can't be read at the moment, and who is called when that begins or ends. */
const broken = new Set();
const watchers = new Set();

/** Have `watcher` called: with true when something can't be read, with false when all can again, with null if none is. */
export function watchConnection(watcher) {
  watchers.add(watcher);
}

/** Note that what `reader` reads from the service is broken, or is not. */
export function mark(reader, isBroken) {
  const before = broken.size > 0;
  if (isBroken) broken.add(reader);
  else broken.delete(reader);
  if (before !== broken.size > 0) for (const watcher of watchers) watcher(broken.size > 0);
}

/** Note that it reads no more. */
export function forget(reader) {
  if (broken.delete(reader) && broken.size === 0) for (const watcher of watchers) watcher(null);
}

export class Stream {
  /** `take({id, type, data})` is given each event, data as text; `over(reason)` is called once nothing more comes. */
  constructor(path, take, over = () => {}) {
    Object.assign(this, { path, take, over, last: 0, pauseMs: FIRST_PAUSE_MS });
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
        if (error.final) {
          mark(this, false);
          this.over(error.message);
          return;
        }
      }
      if (this.closed || this.ended) break;
      mark(this, true);
      await new Promise((resolve) => {
        setTimeout(resolve, this.pauseMs);
      });
      this.pauseMs = Math.min(LONGEST_PAUSE_MS, 1.6 * this.pauseMs);
    }
    mark(this, false);
    if (!this.closed) this.over("");
  }

  async read() {
    const headers = { Accept: "text/event-stream" };
    if (this.last) headers["Last-Event-ID"] = String(this.last);
    this.aborter = new AbortController();
    const response = await send(this.path, { headers, signal: this.aborter.signal });
    if (response.status === 204) {
      this.ended = true;
      return;
    }
    if (response.status >= 400 && response.status < 500 && response.status !== 429) {
      const { detail } = await response.json();
      throw Object.assign(new Error(detail), { final: true });
    }
    if (!response.ok) return;
    mark(this, false);
    await this.readBody(response.body.pipeThrough(new TextDecoderStream()).getReader());
  }

  async readBody(reader) {
    let rest = "";
    while (!this.ended) {
      const silence = setTimeout(() => this.aborter.abort(), SILENCE_MS);
      const { done, value } = await reader.read().finally(() => clearTimeout(silence));
      if (done) return;
      this.pauseMs = FIRST_PAUSE_MS;
      const frames = (rest + value).split("\n\n");
      rest = frames.pop();
      for (const frame of frames) this.takeFrame(frame);
    }
  }

  takeFrame(frame) {
    const fields = { id: "", event: "", data: "" };
    for (const line of frame.split("\n")) {
      const at = line.indexOf(": ");
      if (at > 0) fields[line.slice(0, at)] = line.slice(at + 2);
    }
    if (!fields.id || Number(fields.id) <= this.last) return;
    this.last = Number(fields.id);
    this.ended = fields.event === "end";
    this.take({ id: this.last, type: fields.event, data: fields.data });
  }
}
