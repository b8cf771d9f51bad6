// The native build that answers are compared with, and what it makes.
import { execFileSync } from "node:child_process";
import { existsSync, mkdtempSync, readFileSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";

import { Rows } from "../../build/web/tandem/memory.mjs";
import { layouts } from "../../build/web/tandem/rows.mjs";

export const ROOT = fileURLToPath(new URL("../../", import.meta.url));
const builds = process.env.TANDEM_NATIVE_BUILD ? [process.env.TANDEM_NATIVE_BUILD] : ["test", "release"].map((name) => join(ROOT, "build", name));
const parts = { bvhbuild: "tools/bvhbuild/bvhbuild", library: "bindings/c/libtandem.so" };
const build = builds.find((folder) => Object.values(parts).every((part) => existsSync(join(folder, part))));

/** Says why there is nothing to compare with; false where there is. */
export const missing = build === undefined && `no native build in ${builds.join(" or ")} (TANDEM_NATIVE_BUILD)`;

const folder = mkdtempSync(join(tmpdir(), "tandem-web-"));
process.on("exit", () => execFileSync("rm", ["-rf", folder]));
let program = null;

/** The path of the .bvh file that bvhbuild makes of a mesh file. */
export function bvh_of(mesh, ...options) {
  const path = join(folder, `${mesh.replaceAll(/[^\w.]/g, "_")}${options.join("")}.bvh`);
  if (!existsSync(path)) execFileSync(join(build, parts.bvhbuild), ["--quiet", ...options, mesh, "-o", path]);
  return path;
}

/** Returns what the C library answers about two .bvh files at poses: see answers.c. */
export function answers(a, b, poses) {
  if (program === null) {
    program = join(folder, "answers");
    const library = join(build, "bindings/c");
    execFileSync("cc", ["-std=c99", "-o", program, join(ROOT, "tests/web/answers.c"), `-I${ROOT}/bindings/c/include`, `-L${library}`, "-ltandem", `-Wl,-rpath,${library}`]);
  }
  const [given, found] = [join(folder, "poses"), join(folder, "answers.bin")];
  writeFileSync(given, new Uint8Array(Float64Array.from(poses.flat()).buffer));
  execFileSync(program, [a, b, given, found]);
  return readFileSync(found);
}

/** A mesh of the repository, or of those that were downloaded elsewhere; null where it is not there. */
export function mesh_path(name) {
  const places = [join(ROOT, "assets", name), join(process.env.TANDEM_MESHES ?? join(ROOT, "../shared/meshes"), name)];
  return places.find((path) => existsSync(path)) ?? null;
}

/** The answers of answers(), one after the other: four kinds of rows, and counters. */
export function* each_answer(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  let at = 0;
  const take = (size) => bytes.subarray(at, (at += size));
  const COUNTERS = ["object_pairs", "block_pairs", "candidates", "decided_by_float32", "decided_by_float64", "decided_exactly", "contacts"];
  while (at < bytes.length) {
    const rows = ["contact", "manifold", "manifold_point", "distance"].map((name) => {
      const count = Number(view.getBigUint64(at, true));
      at += 8;
      return take(count * layouts[`tandem_${name}`].bytes);
    });
    const counters = Object.fromEntries(COUNTERS.map((name, i) => [name, Number(view.getBigUint64(at + 8 * i, true))]));
    at += 8 * COUNTERS.length;
    yield { rows, counters };
  }
}

/** A field of rows that each_answer() gives. */
export function column(bytes, name, field) {
  return [...new Rows(`tandem_${name}`, bytes).column(field)];
}
