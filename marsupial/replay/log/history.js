/* Values over time: what held from a moment on, found again at any moment. */

/** Index of the last of the growing `times` that is not after t, or -1.
    @type {(times: ArrayLike<number>, t: number) => number} */
export function lastAt(times, t) {
  let low = 0;
  let high = times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] <= t) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

/** Values that hold from a moment on, added in order of time.
    @template T */
export class History {
  constructor() {
    /** @type {number[]} */
    this.times = [];
    /** @type {T[]} */
    this.values = [];
  }

  /** @param {number} t
      @param {T} value */
  add(t, value) {
    this.times.push(t);
    this.values.push(value);
  }

  /** @type {(t: number) => number} */
  index(t) {
    return lastAt(this.times, t);
  }

  /** @param {number} t */
  at(t) {
    const i = this.index(t);
    return i < 0 ? null : this.values[i];
  }

  /** The newest value; there has to be one. */
  get last() {
    return this.values[this.values.length - 1];
  }
}

/** Whole numbers in one flat array that grows. */
export class Numbers {
  constructor() {
    this.array = new Int32Array(1024);
    this.length = 0;
  }

  /** @type {(...values: number[]) => void} */
  push(...values) {
    if (this.length + values.length > this.array.length) {
      const larger = new Int32Array(2 * this.array.length);
      larger.set(this.array);
      this.array = larger;
    }
    for (const value of values) this.array[this.length++] = value;
  }
}
