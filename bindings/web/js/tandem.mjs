// Tandem in WebAssembly: the C interface's functions under the names that Python has for them (docs/web.md).
import createCore from "./tandem_core.mjs";
import { Rows, Scratch, textAt } from "./memory.mjs";
import { layouts } from "./rows.mjs";
import { boxes, boxes_around } from "./tree.mjs";

export { Rows };

const OUT_OF_MEMORY = 4, FILE_STATUSES = [100, 199];

/** A status of the library that is not success. */
export class TandemError extends Error {
  constructor(message, { status = 0, status_name = "", subject = null, where = null } = {}) {
    super(message);
    this.name = new.target.name;
    Object.assign(this, { status, status_name, subject, where });
  }
}
/** The bytes of a file cannot be used. */
export class FileError extends TandemError {}
/** The memory of the WebAssembly instance is at its end. */
export class MemoryError extends TandemError {}

let wasm = null;
let loading = null;
let finished = null;

async function instantiate(imports, source) {
  if (source instanceof WebAssembly.Module) return { module: source, instance: await WebAssembly.instantiate(source, imports) };
  if (source instanceof ArrayBuffer || ArrayBuffer.isView(source)) return WebAssembly.instantiate(source, imports);
  const url = new URL(source, import.meta.url);
  if (url.protocol === "file:" && globalThis.process?.versions?.node) {
    const { readFile } = await import("node:fs/promises");
    return WebAssembly.instantiate(await readFile(url), imports);
  }
  const response = await fetch(url);
  if (!response.ok) throw new FileError(`${url}: ${response.status} ${response.statusText}`);
  return WebAssembly.instantiate(await response.arrayBuffer(), imports);
}

async function start(source) {
  wasm = await new Promise((resolve, reject) => {
    createCore({
      instantiateWasm(imports, done) {
        instantiate(imports, source).then(({ instance, module }) => done(instance, module), reject);
        return {};
      },
    }).then(resolve, reject);
  });
  finished = new FinalizationRegistry(({ address, release }) => wasm[release](address));
}

/** Loads the WebAssembly code, once. All else here may be used when the promise is kept. */
export function load(source = "tandem_core.wasm") {
  loading ??= start(source).catch((error) => {
    loading = null;
    throw error;
  });
  return loading;
}

function core() {
  if (wasm === null) throw new TandemError("load() has not been awaited");
  return wasm;
}

function errorOf(status, where = 0) {
  const text = (of) => textAt(wasm, of);
  const subject = text(wasm._tandem_status_subject(status));
  const sentence = text(wasm._tandem_status_explain(status));
  const facts = { status, status_name: text(wasm._tandem_status_name(status)), subject, where: subject === null ? null : where };
  const Kind = status === OUT_OF_MEMORY ? MemoryError : status >= FILE_STATUSES[0] && status <= FILE_STATUSES[1] ? FileError : TandemError;
  return new Kind(subject === null ? sentence : `${subject} ${where}: ${sentence}`, facts);
}

function with_scratch(work) {
  return Scratch.with(core(), () => errorOf(OUT_OF_MEMORY), work);
}

function choice(name, given, choices) {
  const place = choices.indexOf(given);
  if (place < 0) throw new RangeError(`${name} is ${given} where one of ${choices.join(", ")} is wanted`);
  return place;
}

/** An object of the library. delete() frees it; else it is freed some time after nothing refers to it. */
class Handle {
  #address;
  #release;

  constructor(address, release) {
    this.#address = address;
    this.#release = release;
    finished.register(this, { address, release }, this);
  }

  get _address() {
    if (this.#address === 0) throw new TandemError(`this ${this.constructor.name} was deleted`);
    return this.#address;
  }

  delete() {
    if (this.#address === 0) return;
    finished.unregister(this);
    wasm[this.#release](this.#address);
    this.#address = 0;
  }
}

function make_asset(make) {
  return with_scratch((scratch) => {
    const out = scratch.zeros(16);
    const status = make(scratch, out, out + 8);
    if (status !== 0) throw errorOf(status, Number(scratch.view.getBigUint64(out + 8, true)));
    return new Asset(scratch.view.getUint32(out, true));
  });
}

/** The checked contents of one .bvh file; it never changes. Made by from_bytes() and build(). */
export class Asset extends Handle {
  #info = null;
  #levels = null;

  constructor(address) {
    super(address, "_tandem_asset_release");
  }

  static from_bytes(data, { check = "full" } = {}) {
    const bytes = bytesOf(data);
    const check_depth = choice("check", check, ["full", "quick"]);
    return make_asset((scratch, asset, where) =>
      wasm._tandem_asset_from_memory(scratch.bytes(bytes), bytes.byteLength, scratch.struct("tandem_memory_options", { check_depth }), 0, asset, where));
  }

  #filled(name, fill) {
    return with_scratch((scratch) => {
      const address = scratch.struct(name);
      const status = fill(address);
      if (status !== 0) throw errorOf(status);
      return scratch.read(name, address);
    });
  }

  get info() {
    return (this.#info ??= this.#filled("tandem_asset_info", (at) => wasm._tandem_asset_get_info(this._address, at)));
  }

  /** The bytes of the file, without a copy: of use until the library's memory grows, which any call may do. */
  get data() {
    return with_scratch((scratch) => {
      const count = scratch.zeros(4);
      const address = wasm._tandem_asset_data(this._address, count);
      return wasm.HEAPU8.subarray(address, address + scratch.view.getUint32(count, true));
    });
  }

  #level(level) {
    return this.#filled("tandem_level", (at) => wasm._tandem_asset_get_level(this._address, level, at));
  }

  get levels() {
    return (this.#levels ??= Array.from({ length: this.info.level_count }, (_, level) => {
      const { triangles, has_oriented_blocks, has_topology, closed, ...rest } = this.#level(level);
      return Object.freeze({ ...rest, has_oriented_blocks: has_oriented_blocks === 1, has_topology: has_topology === 1, closed: closed === 1 });
    }));
  }

  get first_level() {
    return this.info.first_level;
  }
  get origin() {
    return this.info.origin;
  }
  get hash() {
    return this.info.hash.toString(16).padStart(16, "0");
  }
  get file_bytes() {
    return this.info.file_bytes;
  }
  get source_faces() {
    return this.info.source_faces;
  }
  get source_vertices() {
    return this.info.source_vertices;
  }
  get rounding_error() {
    return this.info.rounding_error;
  }
  get bounds() {
    const { lower, upper, origin } = this.info;
    return { lower: lower.map((x, i) => x + origin[i]), upper: upper.map((x, i) => x + origin[i]) };
  }

  /** Nine numbers for each triangle of a level, its corners in the mesh file's coordinates. */
  triangles(level = 0) {
    const { triangles, triangle_count } = this.#level(level);
    const stored = new Float32Array(core().HEAPU8.buffer, triangles, 12 * triangle_count);
    const found = new Float64Array(9 * triangle_count);
    for (let corner = 0; corner < 3 * triangle_count; ++corner)
      for (let axis = 0; axis < 3; ++axis) found[3 * corner + axis] = stored[4 * corner + axis] + this.origin[axis];
    return found;
  }

  /** The face of the mesh file that each triangle of a level comes from. */
  faces(level = 0) {
    const { triangles, triangle_count } = this.#level(level);
    const stored = new Uint32Array(core().HEAPU8.buffer, triangles, 12 * triangle_count);
    return Uint32Array.from({ length: triangle_count }, (_, triangle) => stored[12 * triangle + 3]);
  }

  coarsest_level(tolerance) {
    return core()._tandem_asset_coarsest_level(this._address, tolerance);
  }

  levels_from(first, count = 0) {
    return make_asset((_, asset) => wasm._tandem_asset_levels_from(this._address, first, count, asset));
  }

  get provenance() {
    return with_scratch((scratch) => {
      const count = scratch.zeros(4);
      const text = wasm._tandem_asset_provenance(this._address, count);
      const bytes = scratch.view.getUint32(count, true);
      return bytes > 0 ? JSON.parse(textAt(wasm, text, bytes)) : null;
    });
  }

  boxes(depth, level = 0) {
    return boxes(this, depth, level);
  }
  boxes_around(point, level = 0) {
    return boxes_around(this, point, level);
  }
}

function bytesOf(data) {
  if (data instanceof ArrayBuffer) return new Uint8Array(data);
  if (ArrayBuffer.isView(data)) return new Uint8Array(data.buffer, data.byteOffset, data.byteLength);
  throw new TypeError("bytes are an ArrayBuffer or a view of one");
}

function read_parts(scratch, address, count) {
  let first_face = 0;
  return Array.from({ length: count }, (_, i) => {
    const part = scratch.read("tandem_mesh_part", address + i * layouts.tandem_mesh_part.bytes);
    const found = { name: textAt(wasm, part.name) ?? "", path: textAt(wasm, part.path) ?? "", first_face, face_count: part.face_count };
    first_face += part.face_count;
    return found;
  });
}

/** The contents of a mesh file: build(mesh.vertices, mesh.triangles, mesh) is what bvhbuild makes of it. */
export function read_mesh(data, name = "") {
  const bytes = bytesOf(data);
  return with_scratch((scratch) => {
    const mesh = wasm._tandem_web_read_mesh(scratch.text(name), scratch.bytes(bytes), bytes.byteLength);
    if (mesh === 0) throw errorOf(OUT_OF_MEMORY);
    try {
      const error = textAt(wasm, wasm._tandem_web_mesh_error(mesh));
      if (error !== null) throw new FileError(name === "" ? error : `${name}: ${error}`, { status_name: "UnreadableMesh" });
      const rows = scratch.read("tandem_mesh", wasm._tandem_web_mesh_rows(mesh));
      const copy = (Kind, address, count) => new Kind(scratch.copy(address, count * Kind.BYTES_PER_ELEMENT).buffer);
      return {
        vertices: copy(Float64Array, rows.positions, 3 * rows.vertex_count),
        triangles: copy(Uint32Array, rows.triangles, 3 * rows.triangle_count),
        face_ids: copy(Uint32Array, rows.faces, rows.triangle_count),
        parts: read_parts(scratch, rows.parts, rows.part_count),
        remarks: textAt(wasm, wasm._tandem_web_mesh_remarks(mesh)).split("\n").slice(0, -1),
      };
    } finally {
      wasm._tandem_web_mesh_destroy(mesh);
    }
  });
}

function mesh_of(scratch, vertices, faces, { face_ids, parts }) {
  const points = Float64Array.from(vertices.length && vertices[0].length ? vertices.flat() : vertices);
  const corners = Uint32Array.from(faces.length && faces[0].length ? faces.flat() : faces);
  if (points.length % 3 || corners.length % 3) throw new RangeError("vertices and faces have three numbers each");
  if (face_ids && 3 * face_ids.length !== corners.length) throw new RangeError("face_ids has a number for each face");
  const mesh = { positions: scratch.bytes(points), vertex_count: points.length / 3, triangles: scratch.bytes(corners), triangle_count: corners.length / 3 };
  if (face_ids) mesh.faces = scratch.bytes(Uint32Array.from(face_ids));
  if (parts) {
    const named = parts.map(({ name, path, face_count }) => ({ name: scratch.text(name), path: scratch.text(path), face_count }));
    Object.assign(mesh, { parts: scratch.list("tandem_mesh_part", named), part_count: named.length });
  }
  return scratch.struct("tandem_mesh", mesh);
}

/** Builds an asset: the bytes that bvhbuild writes for these faces, but for what they say of their making. */
export function build(vertices, faces, options = {}) {
  const { effort = "default", gpu_blocks = true, topology = true, refit = true, imaginary_share = 0, provenance = null } = options;
  return make_asset((scratch, asset) => {
    const given = { effort: choice("effort", effort, ["default", "fast", "best"]), imaginary_share, threads: 1 };
    Object.assign(given, { no_gpu_blocks: Number(!gpu_blocks), no_topology: Number(!topology), no_refit: Number(!refit) });
    if (provenance !== null) given.provenance = scratch.text(provenance);
    return wasm._tandem_asset_build(mesh_of(scratch, vertices, faces, options), scratch.struct("tandem_build_options", given), 0, asset, 0);
  });
}

/** The rotation matrix of a quaternion, whose length does not matter. */
export function rotations({ xyzw, wxyz }) {
  const given = xyzw ?? [wxyz[1], wxyz[2], wxyz[3], wxyz[0]];
  const largest = Math.max(...given.map(Math.abs));
  if (!(largest > 0 && largest < Infinity)) throw new RangeError(`${xyzw ? "xyzw" : "wxyz"} is no rotation: zero, or not finite`);
  const scaled = given.map((part) => part / largest);
  const length = Math.sqrt(scaled.reduce((sum, part) => sum + part * part, 0));
  const [x, y, z, w] = scaled.map((part) => part / length);
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
    [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
    [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
  ];
}

const IDENTITY = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];

function pose_of({ rotation, xyzw, wxyz, translation = [0, 0, 0], transform }) {
  if (transform) {
    const numbers = [...transform].flat();
    if (numbers.length !== 12 && numbers.length !== 16) throw new RangeError("transform has three or four rows of four numbers");
    return { rotation: [0, 4, 8].map((row) => numbers.slice(row, row + 3)), translation: [numbers[3], numbers[7], numbers[11]] };
  }
  const turned = rotation ?? (xyzw || wxyz ? rotations({ xyzw, wxyz }) : IDENTITY);
  if ([...turned].flat().length !== 9 || translation.length !== 3) throw new RangeError("a rotation has nine numbers, a translation three");
  return { rotation: turned, translation };
}

function instance_of(body) {
  return { asset: body.asset ?? 0, pose: pose_of(body) };
}

// The lists that options have: [field of the struct, field with their number, layout of a row, or how many float64]. An option
// without an entry is a number or a truth value of its own name.
const LISTS = {
  pairs: ["pairs", "pair_count", "tandem_object_pair"],
  motion: ["motion", "motion_count", "tandem_motion"],
  former: ["former", "former_count", "tandem_former_nearest"],
  points: ["points", "point_count", 3],
  origins: ["origins", "ray_count", 3],
  directions: ["directions", "ray_count", 3],
};
const WORDS = { mode: ["exact", "fast", "boxes"], hits: ["first", "any", "all"] };
const CONTACTS = 1, DISTANCES = 2, IMPACTS = 3, VERDICTS = 4;

// The questions: what the rows of their object pairs are asked with, and the functions that give rows.
const QUESTIONS = {
  contacts: { pairs: CONTACTS, options: "tandem_contact_options", find: "_tandem_scene_find_contacts",
    rows: { contacts: ["_tandem_scene_contacts", "tandem_contact"] } },
  manifolds: { pairs: CONTACTS, options: "tandem_manifold_options", find: "_tandem_scene_find_manifolds",
    rows: { manifolds: ["_tandem_scene_manifolds", "tandem_manifold"], points: ["_tandem_scene_points", "tandem_manifold_point"] } },
  contained: { pairs: CONTACTS, find: "_tandem_scene_find_contained", rows: { contained: ["_tandem_scene_contained", "tandem_containment"] } },
  distances: { pairs: DISTANCES, options: "tandem_distance_options", find: "_tandem_scene_find_distances",
    rows: { distances: ["_tandem_scene_distances", "tandem_distance"] } },
  impacts: { pairs: IMPACTS, options: "tandem_impact_options", find: "_tandem_scene_find_impacts",
    rows: { impacts: ["_tandem_scene_impacts", "tandem_impact"] } },
  verdicts: { pairs: VERDICTS, options: "tandem_tolerance_options", find: "_tandem_scene_find_verdicts",
    rows: { verdicts: ["_tandem_scene_verdicts", "tandem_verdict"] } },
  closest: { options: "tandem_closest_options", find: "_tandem_scene_find_closest", rows: { closest: ["_tandem_scene_closest", "tandem_closest_point"] } },
  rays: { options: "tandem_ray_options", find: "_tandem_scene_find_rays", rows: { rays: ["_tandem_scene_rays", "tandem_ray_hit"] } },
};

function write_list(scratch, fields, option, value) {
  const [pointer, number, row] = LISTS[option];
  const pair = (given) => (Array.isArray(given) ? { a: given[0], b: given[1] } : given);
  if (typeof row === "string") {
    const rows = [...value].map(option === "pairs" ? pair : (given) => given);
    return Object.assign(fields, { [pointer]: scratch.list(row, rows), [number]: rows.length });
  }
  const numbers = Float64Array.from(value.length && value[0].length ? value.flat() : value);
  if (numbers.length % row) throw new RangeError(`${option} has ${row} numbers in a row`);
  return Object.assign(fields, { [pointer]: scratch.bytes(numbers), [number]: numbers.length / row });
}

function options_of(scratch, layout, given) {
  const fields = {};
  for (const [option, value] of Object.entries(given)) {
    if (value === undefined || value === null) continue;
    if (option in LISTS) write_list(scratch, fields, option, value);
    else if (option in WORDS) fields[option] = choice(option, value, WORDS[option]);
    else fields[option] = Number(value);
    if (option === "reach") fields.limit_reach = 1;
  }
  return scratch.struct(layout, fields);
}

/** Posed meshes, of which any number of questions can be asked. */
export class Scene extends Handle {
  constructor(assets, bodies = []) {
    const address = with_scratch((scratch) => {
      const out = scratch.zeros(4);
      const status = wasm._tandem_scene_create(0, out);
      if (status !== 0) throw errorOf(status);
      return scratch.view.getUint32(out, true);
    });
    super(address, "_tandem_scene_destroy");
    with_scratch((scratch) => {
      const list = scratch.bytes(Uint32Array.from(assets, (asset) => asset._address));
      this.#check(wasm._tandem_scene_set_assets(this._address, list, assets.length));
    });
    if (bodies.length > 0) this.place(bodies);
  }

  #check(status) {
    if (status !== 0) throw errorOf(status, Number(core()._tandem_scene_where(this._address)));
  }

  /** Places all bodies anew. */
  place(bodies) {
    with_scratch((scratch) => this.#check(wasm._tandem_scene_place(this._address, scratch.list("tandem_instance", bodies.map(instance_of)), bodies.length, 0)));
    return this;
  }

  /** Moves a body and leaves the others alone. */
  move(body, pose) {
    with_scratch((scratch) => {
      const number = scratch.bytes(Uint32Array.of(body));
      this.#check(wasm._tandem_scene_move(this._address, number, scratch.struct("tandem_pose", pose_of(pose)), 1));
    });
  }

  #rows(scratch, layout, get) {
    const count = scratch.zeros(4);
    const address = get(count);
    return new Rows(layout, scratch.copy(address, scratch.view.getUint32(count, true) * layouts[layout].bytes));
  }

  get #counters() {
    return with_scratch((scratch) => {
      const address = scratch.struct("tandem_counters");
      this.#check(wasm._tandem_scene_get_counters(this._address, address));
      return scratch.read("tandem_counters", address);
    });
  }

  #ask(name, given) {
    const question = QUESTIONS[name];
    return with_scratch((scratch) => {
      const options = question.options ? [options_of(scratch, question.options, given)] : [];
      this.#check(core()[question.find](this._address, ...options));
      const answer = {};
      if (question.pairs) answer.pairs = this.#rows(scratch, "tandem_object_pair", (count) => wasm._tandem_scene_pairs(this._address, question.pairs, count));
      for (const [key, [get, layout]] of Object.entries(question.rows)) answer[key] = this.#rows(scratch, layout, (count) => wasm[get](this._address, count));
      return Object.assign(answer, { counters: this.#counters[name] });
    });
  }

  contacts(options = {}) {
    return this.#ask("contacts", options);
  }
  manifolds({ match_previous = true, ...options } = {}) {
    return this.#ask("manifolds", { ignore_previous: !match_previous, ...options });
  }
  contained() {
    return this.#ask("contained", {});
  }
  distances(options = {}) {
    return this.#ask("distances", options);
  }
  impacts(motion, duration, options = {}) {
    return this.#ask("impacts", { motion, duration, ...options });
  }
  verdicts(options) {
    return this.#ask("verdicts", options);
  }
  closest(points, options = {}) {
    return this.#ask("closest", { points, ...options });
  }
  rays(origins, directions, options = {}) {
    return this.#ask("rays", { origins, directions, ...options });
  }
}

/** The version of the library, "0.1.0". */
export function version() {
  const number = core()._tandem_version();
  return [Math.floor(number / 10000), Math.floor(number / 100) % 100, number % 100].join(".");
}
