// The state of the page, which the address after # holds.
export const START = {
  a: "cow.obj", b: "cow.obj", la: 0, lb: 0,
  position: [0.35, 0.4, 0.05], q: [0, 0, 0.3826834323650898, 0.9238795325112867],
  view: { theta: 0.9, phi: 0.35, distance: 0 },
  contacts: true, manifolds: true, distance: true, tree: false, mode: "move",
};
const SHOWN = { contacts: "c", manifolds: "m", distance: "d", tree: "t" };

const numbers_in = (text, count) => {
  const numbers = (text ?? "").split(",").map(Number);
  return text && numbers.length === count && numbers.every(Number.isFinite) ? numbers : null;
};

export function state_of(hash) {
  const given = new URLSearchParams(hash.replace(/^#/, ""));
  const state = structuredClone(START);
  for (const name of ["a", "b"]) if (given.get(name)) state[name] = given.get(name);
  for (const name of ["la", "lb"]) if (/^\d+$/.test(given.get(name) ?? "")) state[name] = Number(given.get(name));
  state.position = numbers_in(given.get("p"), 3) ?? state.position;
  const q = numbers_in(given.get("q"), 4);
  if (q && Math.hypot(...q) > 0) state.q = q.map((part) => part / Math.hypot(...q));
  const view = numbers_in(given.get("v"), 3);
  if (view && view[2] >= 0) state.view = { theta: view[0], phi: Math.min(1.5, Math.max(-1.5, view[1])), distance: view[2] };
  if (given.has("show")) for (const [name, letter] of Object.entries(SHOWN)) state[name] = given.get("show").includes(letter);
  return state;
}

export function hash_of(state) {
  const shown = Object.entries(SHOWN).map(([name, letter]) => (state[name] ? letter : "")).join("");
  const { theta, phi, distance } = state.view;
  const view = [theta, phi, distance].map((x) => Number(x.toPrecision(6)));
  const parts = { a: state.a, b: state.b, la: state.la, lb: state.lb, p: state.position, q: state.q, v: view, show: shown };
  return "#" + Object.entries(parts).map(([name, value]) => `${name}=${[value].flat().map((part) => encodeURIComponent(part)).join(",")}`).join("&");
}
