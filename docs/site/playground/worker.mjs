// All of the library's work. Messages carry a number, which the answer repeats.
import * as tandem from "./tandem/tandem.mjs";
import { sphere } from "./shapes.mjs";

const bodies = { a: null, b: null };
let scene = null;

function open(name, bytes, triangles) {
  if (triangles) {
    const { vertices, faces } = sphere(triangles);
    return tandem.build(vertices, faces, { effort: "fast" });
  }
  const is_tree = new Uint8Array(bytes, 0, Math.min(1, bytes.byteLength))[0] === 0x89;
  if (is_tree || name.toLowerCase().endsWith(".bvh")) return tandem.Asset.from_bytes(bytes);
  const mesh = tandem.read_mesh(bytes, name);
  return tandem.build(mesh.vertices, mesh.triangles, mesh);
}

function shown(body) {
  return body.at_level.levels[0];
}

/** Takes the level of a body that is asked about, and says what there is to draw. */
function show_level(body, level) {
  body.at_level?.delete();
  const most = body.asset.levels.length - 1;
  body.level = Math.min(level, most);
  body.at_level = body.asset.levels_from(body.level, 1);
  scene?.delete();
  scene = bodies.a && bodies.b ? new tandem.Scene([bodies.a.at_level, bodies.b.at_level]) : null;
  const { lower, upper } = body.asset.bounds;
  const centre = lower.map((x, axis) => (x + upper[axis]) / 2);
  const corners = (body.corners = body.at_level.triangles());
  const positions = new Float32Array(corners.length);
  for (let i = 0; i < corners.length; ++i) positions[i] = corners[i] - centre[i % 3];
  return { level: body.level, levels: body.asset.levels, centre, radius: Math.hypot(...upper.map((x, axis) => x - lower[axis])) / 2, positions,
    triangle_count: shown(body).triangle_count, has_topology: shown(body).has_topology };
}

function load({ slot, name, bytes, triangles, level }) {
  const asset = open(name, bytes, triangles);
  bodies[slot]?.at_level?.delete();
  bodies[slot]?.asset.delete();
  bodies[slot] = { asset, at_level: null, level: 0 };
  return show_level(bodies[slot], level);
}

/** The boxes around what a ray hits first, in the coordinates of the body that it hits. */
function boxes_on(ray) {
  const hit = scene.rays(ray.origin, ray.direction).rays.at(0);
  if (!Number.isFinite(hit.t)) return null;
  const slot = hit.body === 0 ? "a" : "b";
  const corners = bodies[slot].corners.subarray(9 * hit.triangle, 9 * hit.triangle + 9);
  const [u, v] = hit.weight;
  const point = [0, 1, 2].map((axis) => (1 - u - v) * corners[axis] + u * corners[3 + axis] + v * corners[6 + axis]);
  return { slot, boxes: bodies[slot].at_level.boxes_around(point) };
}

function ask({ poses, wants, ray }) {
  const begin = performance.now();
  scene.place([{ asset: 0, ...poses.a }, { asset: 1, ...poses.b }]);
  const pairs = [[0, 1]];
  const contacts = scene.contacts({ pairs });
  const has_topology = shown(bodies.a).has_topology && shown(bodies.b).has_topology;
  const manifolds = wants.manifolds && has_topology ? scene.manifolds() : null;
  const distance = wants.distance ? scene.distances({ pairs }).distances.at(0) : null;
  const milliseconds = performance.now() - begin;
  return {
    triangles: { a: [...new Set(contacts.contacts.column("triangle_a"))], b: [...new Set(contacts.contacts.column("triangle_b"))] },
    contact_bytes: contacts.contacts.bytes, contact_count: contacts.contacts.length, counters: contacts.counters,
    manifolds: manifolds && [...manifolds.manifolds], points: manifolds && [...manifolds.points],
    distance, milliseconds, boxes: ray ? boxes_on(ray) : null,
  };
}

const ANSWERS = { load, ask, level: ({ slot, level }) => show_level(bodies[slot], level) };

self.onmessage = async ({ data: { id, kind, ...asked } }) => {
  try {
    await tandem.load();
    const answer = ANSWERS[kind](asked);
    self.postMessage({ id, answer }, answer.positions ? [answer.positions.buffer] : []);
  } catch (error) {
    self.postMessage({ id, error: { name: error.status_name || error.name, message: error.message } });
  }
};
