import { listen } from "./drag.mjs";
import { Picture } from "./picture.mjs";
import { matrix_of, placed, pose_about, turned } from "./pose.mjs";
import { START, hash_of, state_of } from "./state.mjs";

const by_id = (id) => document.getElementById(id);
const SPHERE = /^sphere (\d+)$/;
const SHOWN = ["contacts", "manifolds", "distance", "tree"];

const worker = new Worker(new URL("worker.mjs", import.meta.url), { type: "module" });
const waiting = new Map();
let messages = 0;
worker.onmessage = ({ data: { id, answer, error } }) => {
  const { resolve, reject } = waiting.get(id);
  waiting.delete(id);
  if (error) reject(Object.assign(new Error(error.message), { name: error.name }));
  else resolve(answer);
};
worker.onerror = (event) => tell(`The worker failed: ${event.message}`);

function request(kind, asked, transfer = []) {
  return new Promise((resolve, reject) => {
    waiting.set(++messages, { resolve, reject });
    worker.postMessage({ id: messages, kind, ...asked }, transfer);
  });
}

let state = state_of(location.hash);
const meshes = { a: null, b: null };
const picture = new Picture(by_id("picture"));
let cursor = [0, 0];

function tell(text) {
  by_id("problem").textContent = text;
  by_id("problem").hidden = text === "";
}

const poses = () => ({
  a: pose_about(meshes.a.centre, [0, 0, 0, 1], [0, 0, 0]),
  b: pose_about(meshes.b.centre, state.q, state.position),
});

// ---- The question about the bodies as they stand; while one is being answered, only the newest waits.
let asking = false, again = false;

async function ask() {
  if (!meshes.a || !meshes.b) return;
  picture.place("a", matrix_of([0, 0, 0, 1]), [0, 0, 0]);
  picture.place("b", matrix_of(state.q), state.position);
  picture.look({ target: [0, 0, 0], ...state.view });
  picture.draw();
  if (asking) {
    again = true;
    return;
  }
  asking = true;
  try {
    do {
      again = false;
      const asked = { poses: poses(), wants: { manifolds: state.manifolds, distance: state.distance }, ray: state.tree ? picture.ray(...cursor) : null };
      const answer = await request("ask", asked);
      show(answer, asked);
    } while (again);
    history.replaceState(null, "", hash_of(state));
  } catch (error) {
    tell(`${error.name}: ${error.message}`);
  } finally {
    asking = false;
  }
}

const format = (x) => (x === 0 ? "0" : Math.abs(x) >= 1e-3 && Math.abs(x) < 1e6 ? x.toPrecision(6) : x.toExponential(4));
// A bound that is rounded stays one.
function rounded_up(x) {
  if (x === 0) return "0";
  const unit = 10 ** (Math.floor(Math.log10(x)) - 2);
  return String(Number((Math.ceil(x / unit) * unit).toPrecision(3)));
}
const count = (x) => x.toLocaleString("en");

function show(answer, { poses: at }) {
  const { counters, manifolds, points, distance, boxes } = answer;
  for (const slot of ["a", "b"]) picture.show_contacts(slot, state.contacts ? answer.triangles[slot] : []);
  picture.clear_marks();
  if (manifolds) show_manifolds(points);
  if (distance) {
    if (distance.upper > 0) picture.add_lines("nearest", [[distance.point_a, distance.point_b]]);
    picture.add_points("nearest", [distance.point_a, distance.point_b]);
  }
  if (boxes) picture.add_boxes(boxes.boxes, (corner) => placed(at[boxes.slot], corner));
  const texts = {
    contacts: count(answer.contact_count),
    manifolds: manifolds ? `${count(manifolds.length)}, ${count(points.length)}` : "not asked",
    depth: manifolds ? format(Math.max(0, ...manifolds.map(({ depth }) => depth))) : "not asked",
    distance: distance ? format(distance.upper) : "not asked",
    time: `${answer.milliseconds.toFixed(2)} ms`,
    work: `${count(counters.block_pairs)}, ${count(counters.candidates)}`,
    decided: `${count(counters.decided_by_float32)}, ${count(counters.decided_by_float64)}, ${count(counters.decided_exactly)}`,
    boxes: boxes ? count(boxes.boxes.length) : "–",
  };
  for (const [name, text] of Object.entries(texts)) by_id(`found-${name}`).textContent = text;
  document.body.dataset.answered = String(Number(document.body.dataset.answered ?? 0) + 1);
  picture.draw();
}

// A line at each point along its normal: as long as the depth, and at least so long that it is seen.
function show_manifolds(points) {
  const least = 0.1 * meshes.b.radius;
  const ends = points.map(({ position, normal, depth }) => [position, position.map((x, i) => x + Math.max(depth, least) * normal[i])]);
  picture.add_lines("normal", ends);
  picture.add_points("normal", points.map(({ position }) => position));
}

// ---- Meshes
function fit_view() {
  state.view.distance = 2.4 * Math.max(meshes.a.radius, meshes.b.radius) + 1.2 * Math.hypot(...state.position);
}

function took(slot, mesh) {
  meshes[slot] = mesh;
  state[`l${slot}`] = mesh.level;
  const select = by_id(`level-${slot}`);
  select.replaceChildren(...mesh.levels.map(({ triangle_count, error_bound }, level) =>
    new Option(`${count(triangle_count)} ± ${rounded_up(error_bound)}`, level)));
  select.value = String(mesh.level);
  select.disabled = mesh.levels.length === 1;
  picture.set_mesh(slot, mesh.positions);
}

async function load(slot, name, bytes) {
  by_id("wait").textContent = `Loading ${name} …`;
  tell("");
  const spheres = SPHERE.exec(name);
  try {
    if (!bytes && !spheres) {
      const response = await fetch(new URL(`meshes/${encodeURIComponent(name)}`, import.meta.url));
      if (!response.ok) throw Object.assign(new Error(`${name} is not in the list`), { name: "NoSuchMesh" });
      bytes = await response.arrayBuffer();
    }
    took(slot, await request("load", { slot, name, bytes, triangles: spheres && Number(spheres[1]), level: state[`l${slot}`] }, bytes ? [bytes] : []));
    state[slot] = name;
    const select = by_id(`mesh-${slot}`);
    if (![...select.options].some(({ value }) => value === name)) select.add(new Option(name, name));
    select.value = name;
    return true;
  } catch (error) {
    tell(`${error.name}: ${error.message}`);
    by_id(`mesh-${slot}`).value = state[slot];
    return false;
  } finally {
    by_id("wait").textContent = "";
  }
}

async function change(slot, name, bytes) {
  state[`l${slot}`] = 0;
  if (!(await load(slot, name, bytes)) || !meshes.a || !meshes.b) return;
  fit_view();
  ask();
}

function open_file(slot, file) {
  if (file) file.arrayBuffer().then((bytes) => change(slot, file.name, bytes));
}

// ---- Controls
const act = {
  point(x, y) {
    cursor = [x, y];
    if (state.tree) ask();
  },
  move(...parts) {
    const height = 2 * Math.tan((20 * Math.PI) / 180) * state.view.distance;
    const axes = picture.axes();
    state.position = state.position.map((x, i) => x + height * parts.reduce((sum, part, k) => sum + part * axes[k][i], 0));
    ask();
  },
  turn(about_up, about_right) {
    const [right, up] = picture.axes();
    state.q = turned(turned(state.q, up, about_up), right, about_right);
    ask();
  },
  look(around, up) {
    const { view } = state;
    view.theta -= around;
    view.phi = Math.min(1.5, Math.max(-1.5, view.phi + up));
    ask();
  },
  zoom(factor) {
    state.view.distance *= factor;
    ask();
  },
};

function show_controls() {
  for (const name of SHOWN) by_id(`show-${name}`).checked = state[name];
}

function listen_to_controls() {
  listen(by_id("picture"), () => document.querySelector("input[name=mode]:checked").value, act);
  for (const name of SHOWN) {
    by_id(`show-${name}`).addEventListener("change", ({ target }) => {
      state[name] = target.checked;
      ask();
    });
  }
  for (const slot of ["a", "b"]) {
    by_id(`mesh-${slot}`).addEventListener("change", ({ target }) => change(slot, target.value));
    by_id(`file-${slot}`).addEventListener("change", ({ target }) => open_file(slot, target.files[0]));
    by_id(`level-${slot}`).addEventListener("change", async ({ target }) => {
      took(slot, await request("level", { slot, level: Number(target.value) }));
      ask();
    });
  }
  const stage = by_id("stage");
  for (const kind of ["dragenter", "dragover", "dragleave", "drop"]) {
    stage.addEventListener(kind, (event) => {
      event.preventDefault();
      stage.classList.toggle("dropping", kind === "dragenter" || kind === "dragover");
      if (kind === "drop") open_file("b", event.dataTransfer.files[0]);
    });
  }
  by_id("link").addEventListener("click", async () => {
    history.replaceState(null, "", hash_of(state));
    await navigator.clipboard.writeText(location.href).then(() => (by_id("copied").textContent = "The link is on the clipboard."),
      () => (by_id("copied").textContent = "The link is in the address of this page."));
  });
  by_id("reset").addEventListener("click", () => restart(structuredClone(START)));
  window.addEventListener("hashchange", () => restart(state_of(location.hash)));
}

async function restart(to) {
  state = to;
  show_controls();
  for (const slot of ["a", "b"]) if (!(await load(slot, state[slot]))) await load(slot, START[slot]);
  if (state.view.distance === 0) fit_view();
  await ask();
  document.body.dataset.ready = "yes";
}

async function start() {
  const names = [...(await (await fetch(new URL("meshes/list.json", import.meta.url))).json()), "sphere 2000", "sphere 100000"];
  for (const slot of ["a", "b"]) by_id(`mesh-${slot}`).replaceChildren(...names.map((name) => new Option(name, name)));
  listen_to_controls();
  await restart(state);
}

start().catch((error) => tell(`${error.name}: ${error.message}`));
