/* What a strategy guesses of unknown ground, in the signs of targets: filled where carriers can explore, hollow where
   only rovers can. It is drawn below the known map, which covers it as it grows. */

const FILLED = 0.13; // opacity
const HOLLOW = 0.4;
const INSET = 0.06; // of the side of a square, as its corners are round: a guess has no sharp border

/** @type {(g: Context, guess: GuessedGround, camera: Camera, ink: Ink) => void} */
export function drawGuess(g, { corner, side, halls, rooms }, { left, top, scale }, ink) {
  const wide = side * scale;
  /** @type {(square: Cell) => Point} */
  const place = ([column, row]) => [
    left + (corner[0] + column * side) * scale,
    top - (corner[1] + (row + 1) * side) * scale,
  ];
  for (const square of halls) hall(g, ...place(square), wide, wide, ink);
  for (const square of rooms) room(g, ...place(square), wide, wide, ink);
}

/** @type {(g: Context, x: number, y: number, wide: number, high: number, ink: Ink) => void} */
export function hall(g, x, y, wide, high, ink) {
  outline(g, x, y, wide, high);
  g.globalAlpha = FILLED;
  g.fillStyle = ink.frontier;
  g.fill();
  g.globalAlpha = 1;
}

/** @type {(g: Context, x: number, y: number, wide: number, high: number, ink: Ink) => void} */
export function room(g, x, y, wide, high, ink) {
  outline(g, x, y, wide, high);
  g.globalAlpha = HOLLOW;
  g.strokeStyle = ink.frontier;
  g.lineWidth = 1.5;
  g.stroke();
  g.globalAlpha = 1;
}

/** @type {(g: Context, x: number, y: number, wide: number, high: number) => void} */
function outline(g, x, y, wide, high) {
  const inset = INSET * high;
  g.beginPath();
  g.roundRect(x + inset, y + inset, wide - 2 * inset, high - 2 * inset, 3 * inset);
}

/** What is guessed at a cell, in words; null: nothing.
    @type {(guess: GuessedGround, cell: Cell) => string | null} */
export function guessedAt({ corner, side, halls, rooms }, [x, y]) {
  const column = Math.floor((x - corner[0]) / side);
  const row = Math.floor((y - corner[1]) / side);
  /** @type {(square: Cell) => boolean} */
  const isHere = (square) => square[0] === column && square[1] === row;
  if (halls.some(isHere)) return "guessed: carriers can explore it";
  return rooms.some(isHere) ? "guessed: only rovers can explore it" : null;
}
