// tandem.mjs under Node: its answers are those of the native library, byte for byte.
// Usage: node --test tests/web/tandem_test.mjs, after scripts/build_web. Environment: TANDEM_NATIVE_BUILD, TANDEM_MESHES.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { basename, join } from "node:path";
import { before, test } from "node:test";

import * as native from "./native.mjs";
import * as tandem from "../../build/web/tandem/tandem.mjs";

const ASSETS = ["box_12.obj", "box_192.obj", "cow_1500.obj", "cow.obj", "ground.obj"];
const MESHES = ["spot.obj", "teapot.obj", "elephant.ply", "bun_zipper.ply", "ballA.off", "moebius.obj", "link5.stl", "Spider_ascii.stl", "CesiumMilkTruck.glb", "koala.obj"];
const COMPARED = [["box_12.obj", "box_192.obj"], ["cow_1500.obj", "cow_1500.obj"], ["cow.obj", "box_48.obj"], ["cow.obj", "ground.obj"], ["spot.obj", "teapot.obj"],
  ["elephant.ply", "bun_zipper.ply"], ["ballA.off", "ballB.off"]];

before(() => tandem.load());

const read = (path) => tandem.read_mesh(readFileSync(path), basename(path));

function built(path, provenance) {
  const mesh = read(path);
  return tandem.build(mesh.vertices, mesh.triangles, { ...mesh, provenance });
}

function randoms(seed) {
  let state = seed;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 32;
  };
}

// Poses from inside one another to far apart, each mesh turned about its centre.
function poses_of(assets, count) {
  const random = randoms(7);
  return Array.from({ length: count }, () => {
    const pair = assets.map((asset) => {
      const { lower, upper } = asset.bounds;
      const quaternion = Array.from({ length: 4 }, () => random() - 0.5);
      const size = Math.hypot(...upper.map((x, i) => x - lower[i]));
      const rotation = tandem.rotations({ xyzw: quaternion });
      const centre = lower.map((x, i) => (x + upper[i]) / 2);
      return { rotation, centre, size };
    });
    const way = Array.from({ length: 3 }, () => random() - 0.5);
    const share = ((0.1 + 0.9 * random()) * (pair[0].size + pair[1].size)) / 2 / Math.hypot(...way);
    return pair.map(({ rotation, centre }, i) => ({
      rotation,
      translation: rotation.map((row, axis) => i * share * way[axis] - row.reduce((sum, x, k) => sum + x * centre[k], 0)),
    }));
  });
}

const numbers_of = (pose) => [...pose.rotation.flat(), ...pose.translation];

function ask(scene, poses) {
  scene.place(poses.map((pose, asset) => ({ asset, ...pose })));
  const pairs = [[0, 1]];
  const { contacts, counters } = scene.contacts({ pairs });
  const { manifolds, points } = scene.manifolds();
  const { distances } = scene.distances({ pairs });
  return { rows: [contacts, manifolds, points, distances], counters };
}

for (const name of [...ASSETS, ...MESHES]) {
  const path = native.mesh_path(name);
  test(`${name} becomes the bytes that bvhbuild writes`, { skip: native.missing || (path === null && `${name} is not here (TANDEM_MESHES)`) }, () => {
    const theirs = readFileSync(native.bvh_of(path));
    const known = tandem.Asset.from_bytes(theirs);
    const ours = built(path, JSON.stringify(known.provenance));
    assert.equal(ours.hash, known.hash);
    assert.ok(theirs.equals(ours.data), "the bytes differ");
  });
}

let touching_in_all = 0;

for (const [a, b] of COMPARED) {
  const paths = [a, b].map(native.mesh_path);
  test(`${a} and ${b} meet as in the native library`, { skip: native.missing || (paths.includes(null) && `${a} or ${b} is not here (TANDEM_MESHES)`) }, () => {
    const files = paths.map((path) => native.bvh_of(path));
    const assets = files.map((file) => tandem.Asset.from_bytes(readFileSync(file)));
    const scene = new tandem.Scene(assets);
    const poses = poses_of(assets, 20);
    const theirs = [...native.each_answer(native.answers(...files, poses.map((pair) => pair.flatMap(numbers_of))))];
    let touching = 0;
    poses.forEach((pair, i) => {
      const ours = ask(scene, pair);
      ours.rows.forEach((rows, kind) => assert.ok(theirs[i].rows[kind].equals(rows.bytes), `pose ${i}: ${rows.layout} differs`));
      assert.deepEqual(ours.counters, theirs[i].counters);
      touching += Number(ours.rows[0].length > 0);
    });
    assert.ok(touching < poses.length, "the meshes touch at all poses");
    touching_in_all += touching;
  });
}

test("meshes that were compared touched at some poses", { skip: native.missing }, () => assert.ok(touching_in_all > 10, `at ${touching_in_all}`));

test("levels and their proved errors are those of the file", { skip: native.missing }, () => {
  const asset = tandem.Asset.from_bytes(readFileSync(native.bvh_of(native.mesh_path("cow_1500.obj"), "--levels", "auto")));
  assert.ok(asset.levels.length > 1);
  assert.equal(asset.levels[0].error_bound, 0);
  assert.ok(asset.levels.every(({ error_bound }, i) => i === 0 || error_bound > asset.levels[i - 1].error_bound));
  const coarsest = asset.levels.at(-1);
  assert.equal(asset.coarsest_level(coarsest.error_bound), asset.levels.length - 1);
  const shown = asset.levels_from(asset.levels.length - 1);
  assert.equal(shown.triangles().length, 9 * coarsest.triangle_count);
  const scene = new tandem.Scene([asset, asset], [{}, { asset: 1, translation: [100, 0, 0] }]);
  const verdict = () => scene.verdicts({ tolerance: 0, pairs: [[0, 1]] }).verdicts.at(0).verdict;
  assert.equal(verdict(), 0);
  scene.move(1, { translation: [0.1, 0, 0] });
  assert.equal(verdict(), 1);
});

test("a box is built of vertices and faces, and its depths are known", () => {
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => [i & 1, (i >> 1) & 1, (i >> 2) & 1]);
  const faces = [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4], [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5]];
  const box = tandem.build(corners, faces);
  assert.deepEqual([box.levels[0].triangle_count, box.levels[0].closed], [12, true]);
  assert.deepEqual(box.bounds, { lower: [0, 0, 0], upper: [1, 1, 1] });
  const scene = new tandem.Scene([box], [{}, { translation: [0.25, 0.25, 0.75] }]);
  assert.ok(scene.contacts().contacts.length > 0);
  const { manifolds, points } = scene.manifolds();
  assert.equal(manifolds.length, 1);
  assert.ok(Math.abs(manifolds.at(0).depth - 0.25) < 1e-12);
  assert.deepEqual(manifolds.at(0).normal.map(Math.abs), [0, 0, 1]);
  assert.equal(points.column("position").length, 3 * points.length);
  scene.move(1, { translation: [3, 0, 0] });
  const { distances } = scene.distances();
  assert.ok(Math.abs(distances.at(0).upper - 2) < 2e-6);
  assert.equal(scene.rays([-1, 0.25, 0.5], [1, 0, 0], { hits: "all" }).rays.length, 4);
  assert.equal(scene.closest([[0.5, 0.5, 0.75]], { sides: true }).closest.at(0).winding, 1);
});

test("the boxes around a point hold it, from the root block down", () => {
  const cow = built(native.mesh_path("cow_1500.obj"));
  const [all] = cow.boxes(0);
  assert.ok([0, 1, 2].every((axis) => all.lower[axis] <= cow.bounds.lower[axis] && cow.bounds.upper[axis] <= all.upper[axis]));
  const point = Array.from(cow.triangles().slice(0, 3));
  const around = cow.boxes_around(point);
  assert.ok(around.some(({ is_leaf }) => is_leaf));
  assert.equal(around[0].depth, 1);
  for (const { lower, upper } of around) assert.ok(point.every((x, i) => lower[i] <= x && x <= upper[i]));
  assert.deepEqual(cow.boxes_around([1e9, 0, 0]), []);
  assert.throws(() => cow.boxes(1, 7), RangeError);
});

test("files that cannot be used give errors with names", () => {
  const text = (of) => new TextEncoder().encode(of);
  assert.throws(() => tandem.Asset.from_bytes(text("HIERARCHY")), { name: "FileError", status_name: "BiovisionMotionCapture" });
  assert.throws(() => tandem.Asset.from_bytes(new Uint8Array(300)), { name: "FileError", status_name: "NotTandem" });
  assert.throws(() => tandem.Asset.from_bytes(new Uint8Array(0)), tandem.FileError);
  const good = built(native.mesh_path("box_12.obj")).data.slice();
  assert.throws(() => tandem.Asset.from_bytes(good.subarray(0, good.length - 1)), { name: "FileError", status_name: "Truncated" });
  good[good.length >> 1] ^= 1;
  assert.throws(() => tandem.Asset.from_bytes(good), { name: "FileError", status_name: "ContentChanged" });
  assert.throws(() => tandem.read_mesh(text("v 0 0 x"), "cut.obj"), { name: "FileError", message: /^cut\.obj: line 1: / });
  assert.throws(() => tandem.read_mesh(text("what is this"), "note.txt"), { name: "FileError", message: /is no OBJ, PLY, STL, OFF or glTF file/ });
  assert.throws(() => tandem.read_mesh(new Uint8Array(0), "empty.stl"), { message: "empty.stl: the file is empty" });
  assert.throws(() => tandem.read_mesh(text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 2 0\nv -1 1 0\nf 1 2 3 4 5"), "five.obj"), { message: /face 0 has more than four corners/ });
  assert.throws(() => tandem.read_mesh(text('{"asset": {"version": "2.0"}, "buffers": [{"byteLength": 4, "uri": "far.bin"}]}'), "a.gltf"), { message: /far\.bin/ });
  assert.throws(() => tandem.build([[0, 0, 0]], [[0, 0, 0]]), { name: "TandemError", status_name: "NoTriangle" });
});

test("wrong calls give errors with names, and change nothing", () => {
  const triangle = tandem.build([0, 0, 0, 1, 0, 0, 0, 1, 0], [0, 1, 2]);
  const scene = new tandem.Scene([triangle], [{}]);
  assert.throws(() => scene.place([{}, { rotation: [2, 0, 0, 0, 1, 0, 0, 0, 1] }]), { name: "TandemError", status_name: "PoseNotRigid", subject: "instance", where: 1 });
  assert.throws(() => scene.place([{ asset: 5 }]), { status_name: "UnknownAsset" });
  assert.throws(() => scene.place([{ xyzw: [0, 0, 0, 0] }]), RangeError);
  assert.throws(() => scene.contacts({ mode: "most" }), RangeError);
  assert.throws(() => scene.contacts({ within: -1 }), { status_name: "BadReach" });
  assert.throws(() => scene.contacts({ nearby: 1 }), TypeError);
  scene.place([{}, { wxyz: [1, 0, 0, 0], translation: [0.1, 0.1, 0] }]);
  assert.equal(scene.contacts().contacts.length, 1);
  scene.delete();
  scene.delete();
  assert.throws(() => scene.contacts(), { message: "this Scene was deleted" });
  triangle.delete();
});

test("numbers of a text file are read as the native reader does", { skip: native.missing }, () => {
  const folder = mkdtempSync(join(tmpdir(), "tandem-numbers-"));
  const random = randoms(3);
  const digits = (count) => Array.from({ length: count }, () => Math.floor(random() * 10)).join("");
  const words = ["1e-400", "4.9e-324", "2.2250738585072011e-308", "0.1", ".5", "5.", "1E5", "-0", "+1.5", "0e0", "9007199254740993", "1.00000000000000011102230246251565"];
  while (words.length < 300) words.push(`${random() < 0.5 ? "-" : ""}${digits(1 + 2 * random())}.${digits(40 * random())}e${Math.floor(60 * random() - 40)}`);
  const lines = [];
  for (let i = 0; i < words.length; i += 3) lines.push(`v ${words.slice(i, i + 3).join(" ")}`);
  for (let i = 1; i + 2 <= words.length / 3; ++i) lines.push(`f ${i} ${i + 1} ${i + 2}`);
  const path = join(folder, "numbers.obj");
  writeFileSync(path, lines.join("\n"));
  const theirs = readFileSync(native.bvh_of(path));
  const ours = built(path, JSON.stringify(tandem.Asset.from_bytes(theirs).provenance));
  rmSync(folder, { recursive: true });
  assert.ok(theirs.equals(ours.data));
});

test("memory does not grow over 1,000 queries, nor over 200 assets", () => {
  const cow = built(native.mesh_path("cow_1500.obj"));
  const scene = new tandem.Scene([cow, cow]);
  const poses = poses_of([cow, cow], 10);
  const bytes = () => cow.data.buffer.byteLength;
  const once = () => poses.forEach((pair) => ask(scene, pair));
  const asset_again = () => {
    const copy = tandem.Asset.from_bytes(cow.data);
    new tandem.Scene([copy], [{}]).delete();
    copy.delete();
  };
  once();
  asset_again();
  const after_one = bytes();
  for (let i = 0; i < 100; ++i) once();
  for (let i = 0; i < 200; ++i) asset_again();
  assert.equal(bytes(), after_one);
});

test("what docs/web.md shows runs", async (context) => {
  const [, snippet] = /```js\n(.*?)```/s.exec(readFileSync(join(native.ROOT, "docs/web.md"), "utf-8"));
  const path = join(native.ROOT, "build/web/tandem/snippet.mjs");
  const said = [];
  context.mock.method(globalThis, "fetch", async (name) => new Response(readFileSync(native.mesh_path(name))));
  context.mock.method(console, "log", (...words) => said.push(words));
  writeFileSync(path, snippet);
  try {
    await import(path);
  } finally {
    rmSync(path);
  }
  assert.ok(said.length > 1 && said.at(-1)[1].length > 0);
});

const has_compiler = spawnSync("tsc", ["--version"]).status === 0;
test("the types allow what the module has", { skip: !has_compiler && "there is no tsc (node-typescript)" }, () => {
  const options = ["--noEmit", "--strict", "--target", "es2022", "--module", "node16", "--moduleResolution", "node16", "--lib", "es2022,dom,esnext"];
  const done = spawnSync("tsc", [...options, join(native.ROOT, "tests/web/types.mts")], { encoding: "utf-8" });
  assert.equal(done.stdout, "");
  assert.equal(done.status, 0);
});
