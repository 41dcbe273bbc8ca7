/* The frame of a map: metres to places in cells and back. */

/** Metres in a map's frame of a cell.
    @type {(frame: FrameOfMap, cell: Cell) => Point} */
export function metresOf({ origin_m: [x0, y0, yaw], resolution_m }, [x, y]) {
  const dx = (x + 0.5) * resolution_m;
  const dy = (y + 0.5) * resolution_m;
  return [x0 + Math.cos(yaw) * dx - Math.sin(yaw) * dy, y0 + Math.sin(yaw) * dx + Math.cos(yaw) * dy];
}

/** The place in cells of a point of a map's frame in metres.
    @type {(frame: FrameOfMap, point: Point) => Cell} */
export function placeOf({ origin_m: [x0, y0, yaw], resolution_m }, [x, y]) {
  const dx = (x - x0) / resolution_m;
  const dy = (y - y0) / resolution_m;
  return [Math.cos(yaw) * dx + Math.sin(yaw) * dy - 0.5, Math.cos(yaw) * dy - Math.sin(yaw) * dx - 0.5];
}
