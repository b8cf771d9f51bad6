// Is compiled, not run: the types of tandem.mjs allow what docs/web.md shows, and no more.
import * as tandem from "../../bindings/web/js/tandem.mjs";

async function uses(bytes: ArrayBuffer): Promise<number> {
  await tandem.load();
  const mesh: tandem.Mesh = tandem.read_mesh(bytes, "cow.obj");
  const cow: tandem.Asset = tandem.build(mesh.vertices, mesh.triangles, mesh);
  const scene = new tandem.Scene([cow], [{ translation: [0, 0, 0] }, { xyzw: [0, 0, 0, 1], translation: [0.5, 0, 0] }]);
  const { contacts, counters } = scene.contacts({ pairs: [[0, 1]], mode: "exact" });
  for (const contact of contacts) console.log(contact.face_a, contact.face_b, counters.block_pairs);
  const depths = scene.manifolds().manifolds.column("depth");
  const nearest = scene.distances({ reach: 1 }).distances.at(0);
  try {
    tandem.Asset.from_bytes(bytes);
  } catch (error) {
    if (error instanceof tandem.FileError) console.log(error.status_name, error.where);
  }
  // @ts-expect-error: there is no such mode
  scene.contacts({ mode: "most" });
  // @ts-expect-error: assets are made by build() and from_bytes()
  new tandem.Asset();
  scene.delete();
  return depths.length + (nearest?.upper ?? cow.levels[0].error_bound);
}

void uses;
