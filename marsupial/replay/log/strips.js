/* Cells that were seen, as the mission log writes them (docs/mission-log.md, "Cells"). */

const DIGITS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
const VALUES = new Map([...DIGITS].map((digit, value) => [digit, value]));
const ALIKE = 1;

/** The whole numbers of a text of digits of base 64, five bits each from the lowest on.
    @type {(text: string) => number[]} */
function readNumbers(text) {
  const numbers = [];
  let number = 0;
  let weight = 1;
  for (const digit of text) {
    const value = VALUES.get(digit) ?? 0;
    number += (value & 31) * weight;
    if (value & 32) weight *= 32;
    else {
      numbers.push(number);
      number = 0;
      weight = 1;
    }
  }
  return numbers;
}

/** @type {(n: number) => number} */
function signed(n) {
  return n % 2 ? -(n + 1) / 2 : n / 2;
}

/** Call `take` for each run of cells that the text of a look stands for.
    @type {(text: string, take: TakeRun) => void} */
export function readStrips(text, take) {
  const numbers = readNumbers(text);
  for (let at = 0; at < numbers.length;) {
    const code = numbers[at++];
    for (let left = numbers[at++], row = 0, column = 0; left > 0; left--) {
      const above = numbers[at++];
      row += Math.floor(above / 2);
      column += signed(numbers[at++]);
      let cells = above % 2 ? 1 : numbers[at++] + 1;
      let y = row;
      let x = column;
      take(x, y, cells, code);
      for (let step = above % 2 ? 0 : numbers[at++]; step > 0; step = numbers[at++]) {
        const again = step === ALIKE ? numbers[at++] + 1 : 1;
        if (step > ALIKE) {
          const root = Math.floor(Math.sqrt(step - ALIKE));
          const rest = step - ALIKE - root * root;
          x += signed(rest < root ? rest : root);
          cells += signed(rest < root ? root : rest - root);
        }
        for (let i = 0; i < again; i++) take(x, ++y, cells, code);
      }
    }
  }
}

/** The same for the flat runs (start, length, code) of logs of version 1, on rows of `width` cells.
    @type {(runs: number[], width: number, take: TakeRun) => void} */
export function readRuns(runs, width, take) {
  for (let i = 0; i < runs.length; i += 3) {
    for (let at = runs[i], end = at + runs[i + 1]; at < end;) {
      const row = Math.floor(at / width);
      const stop = Math.min(end, (row + 1) * width);
      take(at - row * width, row, stop - at, runs[i + 2]);
      at = stop;
    }
  }
}
