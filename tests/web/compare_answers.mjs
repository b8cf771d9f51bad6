// Compares answers of a page, JSON on standard input, with those of the native library: compare_answers.mjs MESH. Ends with 77 where there is none.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";

import * as native from "./native.mjs";

if (native.missing) {
  console.error(native.missing);
  process.exit(77);
}
const given = JSON.parse(readFileSync(0));
const file = native.bvh_of(native.mesh_path(process.argv[2]));
const numbers = ({ rotation, translation }) => [...rotation.flat(), ...translation];
const bytes = native.answers(file, file, given.map(({ asked }) => [...numbers(asked.a), ...numbers(asked.b)]));
[...native.each_answer(bytes)].forEach(({ rows, counters }, i) => {
  const [contacts, manifolds, , distances] = rows;
  assert.ok(contacts.equals(Uint8Array.from(given[i].contacts)), `pose ${i}: contacts differ`);
  assert.deepEqual(native.column(manifolds, "manifold", "depth"), given[i].depths, `pose ${i}`);
  assert.deepEqual([...native.column(distances, "distance", "lower"), ...native.column(distances, "distance", "upper")], given[i].distance, `pose ${i}`);
  assert.deepEqual(counters, given[i].counters, `pose ${i}`);
});
