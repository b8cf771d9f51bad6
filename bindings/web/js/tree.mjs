// Places in a .bvh file, version 1 (formats/FORMAT.md).
const SECTION_COUNT = 96, SECTION_TABLE = 128, SECTION_BYTES = 32, BLOCKS = 2, BLOCK_BYTES = 128;
const INTERNAL = 0, LEAF = 1;

class Blocks {
  constructor(asset, level) {
    const { data } = asset;
    const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
    const wanted = asset.first_level + level;
    for (let i = 0; i < view.getUint32(SECTION_COUNT, true); ++i) {
      const row = SECTION_TABLE + i * SECTION_BYTES;
      if (view.getUint32(row, true) !== BLOCKS || view.getUint32(row + 4, true) !== wanted) continue;
      this.first = Number(view.getBigUint64(row + 8, true));
      this.view = view;
      this.origin = asset.origin;
      return;
    }
    throw new RangeError(`level ${level} of ${asset.levels.length}`);
  }

  /** The nodes of a block that are not imaginary. */
  *nodes(block) {
    const at = this.first + block * BLOCK_BYTES;
    for (let node = 0; node < 4; ++node) {
      const number = (place) => this.view.getFloat32(at + 16 * place + 4 * node, true);
      const kind = this.view.getUint32(at + 112 + 4 * node, true);
      if (kind !== INTERNAL && kind !== LEAF) return;
      const side = (sign) => [0, 1, 2].map((axis) => number(axis) + sign * number(axis + 3) + this.origin[axis]);
      yield { lower: side(-1), upper: side(1), index: this.view.getUint32(at + 96 + 4 * node, true), is_leaf: kind === LEAF };
    }
  }
}

/** The boxes of the nodes at a depth, as tandem.tree.boxes of Python: depth 1 has the nodes of the root block. */
export function boxes(asset, depth, level = 0) {
  const blocks = new Blocks(asset, level);
  let row = [0];
  const found = [];
  for (let at = 1; at <= Math.max(depth, 1); ++at) {
    const nodes = row.flatMap((block) => [...blocks.nodes(block)]);
    const inner = nodes.filter((node) => !node.is_leaf);
    found.push(...nodes.filter((node) => node.is_leaf));
    if (at === Math.max(depth, 1) || inner.length === 0) {
      found.push(...inner);
      break;
    }
    row = inner.map((node) => node.index);
  }
  if (depth > 0) return found.map(({ lower, upper }) => ({ lower, upper }));
  const bound = (pick, key) => [0, 1, 2].map((axis) => pick(...found.map((node) => node[key][axis])));
  return [{ lower: bound(Math.min, "lower"), upper: bound(Math.max, "upper") }];
}

/** The nodes, of all depths from 1 on, whose boxes contain a point, in the coordinates of the mesh file. */
export function boxes_around(asset, point, level = 0) {
  const blocks = new Blocks(asset, level);
  const found = [];
  let row = [0];
  for (let depth = 1; row.length > 0; ++depth) {
    const next = [];
    for (const block of row) {
      for (const { lower, upper, index, is_leaf } of blocks.nodes(block)) {
        if (!point.every((x, axis) => lower[axis] <= x && x <= upper[axis])) continue;
        found.push({ depth, lower, upper, is_leaf, index });
        if (!is_leaf) next.push(index);
      }
    }
    row = next;
  }
  return found;
}
