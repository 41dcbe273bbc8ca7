/* Pointers on a canvas: dragging and two fingers on the map, a moment on the lanes. */

const STILL = 5; // points that a finger may slip in a click

/** Called with points of the canvas. `over`: without a button; `moved`: after the camera was.
    @typedef {{
      moved: () => void, clicked: (x: number, y: number) => void,
      over: (x: number, y: number, event: PointerEvent) => void, left: () => void }} MapListener */

/** Called with points of the canvas. `seek` returns whether there is a time.
    @typedef {{
      seek: (x: number) => boolean, clicked: (x: number, y: number) => void,
      over: (x: number, y: number, event: PointerEvent) => void, left: () => void,
      zoom: (factor: number, x: number) => void, all: () => void }} LanesListener */

/** Dragging pans, the wheel and two fingers zoom where the pointer is, a double click shows everything.
    @type {(canvas: HTMLCanvasElement, camera: Camera, on: MapListener) => void} */
export function listenMap(canvas, camera, on) {
  /** @type {Map<number, { x: number, y: number }>} */
  const fingers = new Map();
  let slipped = 0;
  const spread = () => {
    const [a, b] = [...fingers.values()];
    return Math.hypot(a.x - b.x, a.y - b.y) || 1;
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
    slipped = fingers.size > 1 ? Infinity : 0;
    canvas.classList.add("dragging");
  });
  canvas.addEventListener("pointermove", (event) => {
    const last = fingers.get(event.pointerId);
    const { offsetX: x, offsetY: y } = event;
    if (!last) {
      on.over(x, y, event);
      return;
    }
    slipped += Math.abs(x - last.x) + Math.abs(y - last.y);
    const before = fingers.size === 2 ? spread() : 0;
    fingers.set(event.pointerId, { x, y });
    if (fingers.size === 2) {
      const [a, b] = [...fingers.values()];
      camera.zoom(spread() / before, (a.x + b.x) / 2, (a.y + b.y) / 2);
    } else if (slipped > STILL) camera.pan(x - last.x, y - last.y);
    else return;
    on.moved();
  });
  /** @type {(event: PointerEvent) => void} */
  const drop = (event) => {
    fingers.delete(event.pointerId);
    if (!fingers.size) canvas.classList.remove("dragging");
  };
  canvas.addEventListener("pointerup", (event) => {
    if (fingers.has(event.pointerId) && slipped <= STILL) on.clicked(event.offsetX, event.offsetY);
    drop(event);
  });
  canvas.addEventListener("pointercancel", drop);
  canvas.addEventListener("pointerleave", () => on.left());
  canvas.addEventListener("dblclick", () => {
    camera.fit();
    on.moved();
  });
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      camera.zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)), event.offsetX, event.offsetY);
      on.moved();
    },
    { passive: false },
  );
}

/** Pressing and dragging goes to a time; the wheel with ctrl or shift zooms the time, a double click shows all of it.
    @type {(canvas: HTMLCanvasElement, on: LanesListener) => void} */
export function listenLanes(canvas, on) {
  let down = false;
  let from = 0;
  canvas.addEventListener("pointerdown", (event) => {
    down = on.seek(event.offsetX);
    from = event.offsetX;
    if (down) canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (down) on.seek(event.offsetX);
    on.over(event.offsetX, event.offsetY, event);
  });
  canvas.addEventListener("pointerup", (event) => {
    if (Math.abs(event.offsetX - from) <= STILL) on.clicked(event.offsetX, event.offsetY);
    down = false;
  });
  canvas.addEventListener("pointercancel", () => {
    down = false;
  });
  canvas.addEventListener("pointerleave", () => on.left());
  canvas.addEventListener("dblclick", () => on.all());
  canvas.addEventListener(
    "wheel",
    (event) => {
      if (!event.ctrlKey && !event.shiftKey) return;
      event.preventDefault();
      on.zoom(Math.exp(-(event.deltaY || event.deltaX) * (event.deltaMode ? 0.05 : 0.003)), event.offsetX);
    },
    { passive: false },
  );
}
