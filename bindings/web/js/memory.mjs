import { layouts } from "./rows.mjs";

const kinds = {
  u8: { bytes: 1, array: Uint8Array, read: (view, at) => view.getUint8(at), write: (view, at, value) => view.setUint8(at, value) },
  u32: { bytes: 4, array: Uint32Array, read: (view, at) => view.getUint32(at, true), write: (view, at, value) => view.setUint32(at, value, true) },
  i32: { bytes: 4, array: Int32Array, read: (view, at) => view.getInt32(at, true), write: (view, at, value) => view.setInt32(at, value, true) },
  f32: { bytes: 4, array: Float32Array, read: (view, at) => view.getFloat32(at, true), write: (view, at, value) => view.setFloat32(at, value, true) },
  f64: { bytes: 8, array: Float64Array, read: (view, at) => view.getFloat64(at, true), write: (view, at, value) => view.setFloat64(at, value, true) },
  u64: { bytes: 8, array: Float64Array, read: (view, at) => Number(view.getBigUint64(at, true)), write: (view, at, value) => view.setBigUint64(at, BigInt(value), true) },
  big: { bytes: 8, array: BigUint64Array, read: (view, at) => view.getBigUint64(at, true), write: (view, at, value) => view.setBigUint64(at, value, true) },
};

function kindOf(name) {
  return kinds[name] ?? { bytes: layouts[name].bytes, read: (view, at) => readStruct(name, view, at), write: (view, at, value) => writeStruct(name, view, at, value) };
}

function readArray(kind, view, at, [count, ...inner]) {
  if (count === undefined) return kind.read(view, at);
  const bytes = kind.bytes * inner.reduce((product, n) => product * n, 1);
  return Array.from({ length: count }, (_, i) => readArray(kind, view, at + i * bytes, inner));
}

/** An object with the fields of a struct at an address, `reserved` aside. */
export function readStruct(name, view, address) {
  const found = {};
  for (const [field, [kind, offset, ...counts]] of Object.entries(layouts[name].fields))
    if (field !== "reserved" && field !== "struct_size") found[field] = readArray(kindOf(kind), view, address + offset, counts);
  return found;
}

/** Writes the fields that `values` has into a struct of zeros. */
export function writeStruct(name, view, address, values) {
  const { bytes, fields } = layouts[name];
  if (fields.struct_size) view.setUint32(address, bytes, true);
  for (const [field, value] of Object.entries(values)) {
    if (!(field in fields)) throw new TypeError(`${field} is no field of ${name}`);
    const [kindName, offset, ...counts] = fields[field];
    const kind = kindOf(kindName);
    const flat = counts.length > 0 ? [...value].flat(counts.length) : [value];
    flat.forEach((one, i) => kind.write(view, address + offset + i * kind.bytes, one));
  }
}

/** Rows of an answer: their bytes, which belong to the caller and may be transferred to another thread. */
export class Rows {
  constructor(layout, bytes) {
    this.layout = layout;
    this.bytes = bytes;
    this.length = bytes.byteLength / layouts[layout].bytes;
  }

  at(row) {
    if (!(row >= 0 && row < this.length)) return undefined;
    return readStruct(this.layout, new DataView(this.bytes.buffer, this.bytes.byteOffset), row * layouts[this.layout].bytes);
  }

  *[Symbol.iterator]() {
    for (let row = 0; row < this.length; ++row) yield this.at(row);
  }

  /** A field of all rows as a typed array; one that is an array gives its numbers row by row. */
  column(field) {
    const { bytes, fields } = layouts[this.layout];
    const [kindName, offset, ...counts] = fields[field];
    const kind = kinds[kindName];
    const each = counts.reduce((product, n) => product * n, 1);
    const found = new kind.array(this.length * each);
    const view = new DataView(this.bytes.buffer, this.bytes.byteOffset);
    for (let row = 0; row < this.length; ++row)
      for (let i = 0; i < each; ++i) found[row * each + i] = kind.read(view, row * bytes + offset + i * kind.bytes);
    return found;
  }
}

/** Memory of the WebAssembly instance for one call. */
export class Scratch {
  #wasm;
  #taken = [];

  constructor(wasm, noMemory) {
    this.#wasm = wasm;
    this.noMemory = noMemory;
  }

  /** Runs `work` with a Scratch, and frees what it took, whatever happens. */
  static with(wasm, noMemory, work) {
    const scratch = new Scratch(wasm, noMemory);
    try {
      return work(scratch);
    } finally {
      for (const address of scratch.#taken) wasm._free(address);
    }
  }

  /** Memory grows when it is taken, and a view of what it was is empty then: so each use asks for one. */
  get view() {
    return new DataView(this.#wasm.HEAPU8.buffer);
  }

  zeros(bytes) {
    const address = this.#wasm._malloc(Math.max(bytes, 1));
    if (address === 0) throw this.noMemory();
    this.#taken.push(address);
    this.#wasm.HEAPU8.fill(0, address, address + bytes);
    return address;
  }

  struct(name, values = {}) {
    const address = this.zeros(layouts[name].bytes);
    writeStruct(name, this.view, address, values);
    return address;
  }

  list(name, rows) {
    const { bytes } = layouts[name];
    const address = this.zeros(bytes * rows.length);
    const { view } = this;
    rows.forEach((row, i) => writeStruct(name, view, address + i * bytes, row));
    return address;
  }

  bytes(of) {
    const address = this.zeros(of.byteLength);
    this.#wasm.HEAPU8.set(new Uint8Array(of.buffer, of.byteOffset, of.byteLength), address);
    return address;
  }

  text(of) {
    return this.bytes(new TextEncoder().encode(`${of}\0`));
  }

  /** A copy of memory. */
  copy(address, bytes) {
    return this.#wasm.HEAPU8.slice(address, address + bytes);
  }

  read(name, address) {
    return readStruct(name, this.view, address);
  }
}

/** The text at an address, to its zero or of so many bytes. */
export function textAt(wasm, address, bytes) {
  if (address === 0) return null;
  const heap = wasm.HEAPU8;
  return new TextDecoder().decode(heap.slice(address, bytes === undefined ? heap.indexOf(0, address) : address + bytes));
}
