// Mouse, touch and keys on the picture, as calls of `act`: move(along right, up, nearer), turn(about up, about right), look(...), zoom(factor),
// point(x, y) from -1 to 1.
const STEP = 0.05, ANGLE = Math.PI / 36;
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

export function listen(canvas, mode, act) {
  const fingers = new Map();
  const spread = () => {
    const [p, q] = [...fingers.values()];
    return Math.hypot(p.x - q.x, p.y - q.y);
  };

  canvas.addEventListener("pointerdown", (event) => {
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    canvas.setPointerCapture(event.pointerId);
  });
  for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, (event) => fingers.delete(event.pointerId));

  canvas.addEventListener("pointermove", (event) => {
    const box = canvas.getBoundingClientRect();
    act.point((2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height);
    const finger = fingers.get(event.pointerId);
    if (!finger) return;
    const before = fingers.size === 2 ? spread() : 0;
    const [right, up] = [(event.clientX - finger.x) / box.height, (finger.y - event.clientY) / box.height];
    Object.assign(finger, { x: event.clientX, y: event.clientY });
    if (fingers.size === 2) act.zoom(before / Math.max(spread(), 1));
    else if (mode() === "move") act.move(right, up, 0);
    else act[mode()](right * Math.PI, -up * Math.PI);
  });

  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    act.zoom(Math.exp(Math.sign(event.deltaY) * 0.1));
  }, { passive: false });

  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey) return;
    const arrow = ARROWS[event.key];
    if (arrow && event.shiftKey) act.turn(arrow[0] * ANGLE, -arrow[1] * ANGLE);
    else if (arrow && event.altKey) act.look(-arrow[0] * ANGLE, arrow[1] * ANGLE);
    else if (arrow) act.move(arrow[0] * STEP, arrow[1] * STEP, 0);
    else if (event.key === "PageUp") act.move(0, 0, -STEP);
    else if (event.key === "PageDown") act.move(0, 0, STEP);
    else if (event.key === "+" || event.key === "=") act.zoom(0.9);
    else if (event.key === "-") act.zoom(1 / 0.9);
    else return;
    event.preventDefault();
  });
}
