/* Zones of an operator on the map: where robots must not go, what is worth more, and what alone is explored. */

const KINDS = { no_go: "no-go zone", priority: "priority zone", explore: "area to explore" };
const HATCH = 9; // points between two lines across a no-go zone

/** What a zone is, with its name.
    @type {(name: string, zone: LoggedZone) => string} */
export function zoneText(name, { kind, weight }) {
  return `${KINDS[kind]} ${name}${kind === "priority" ? `, worth ${weight} times as much` : ""}`;
}

/** Draw a zone of a kind; `corners` are points of the canvas, which has this size.
    @type {(g: Context, kind: ZoneKind, corners: Point[], ink: Ink, size: Size) => void} */
export function drawZone(g, kind, corners, ink, { width, height }) {
  const colour = kind === "no_go" ? ink.bad : ink.accent;
  g.save();
  g.beginPath();
  corners.forEach(([x, y], k) => {
    if (k) g.lineTo(x, y);
    else g.moveTo(x, y);
  });
  g.closePath();
  g.lineWidth = 2;
  g.fillStyle = g.strokeStyle = colour;
  if (kind === "explore") g.setLineDash([8, 5]);
  g.stroke();
  if (kind !== "explore") {
    g.globalAlpha = 0.15;
    g.fill("evenodd");
  }
  if (kind === "no_go") {
    g.globalAlpha = 0.6;
    g.clip("evenodd");
    g.beginPath();
    for (let x = -height; x < width; x += HATCH) {
      g.moveTo(x, height);
      g.lineTo(x + height, 0);
    }
    g.lineWidth = 1;
    g.stroke();
  }
  g.restore();
}

/** Whether a place in cells lies in a zone, by the even-odd rule.
    @type {(zone: { corners: Cell[] }, place: Cell) => boolean} */
export function isWithin({ corners }, [x, y]) {
  let within = false;
  corners.forEach(([ax, ay], k) => {
    const [bx, by] = corners[(k + 1) % corners.length];
    if (ay <= y !== by <= y && ax + ((y - ay) / (by - ay)) * (bx - ax) > x) within = !within;
  });
  return within;
}
