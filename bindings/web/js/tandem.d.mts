import type {
  ClosestCounters, ClosestPoint, Contact, ContactCounters, Containment, ContainmentCounters, Distance, DistanceCounters, FormerNearest, Impact,
  ImpactCounters, Manifold, ManifoldCounters, ManifoldPoint, Motion, ObjectPair, RayCounters, RayHit, ToleranceCounters, Verdict,
} from "./rows.mjs";

export type {
  ClosestPoint, Contact, Containment, Distance, Impact, Manifold, ManifoldPoint, Motion, ObjectPair, RayHit, Verdict,
} from "./rows.mjs";

/** A status of the library that is not success. */
export class TandemError extends Error {
  /** The number in tandem.h. */
  readonly status: number;
  /** Such as "PoseNotRigid". */
  readonly status_name: string;
  /** This names what `where` counts, such as "instance". */
  readonly subject: string | null;
  /** The number of the row to blame. */
  readonly where: number | null;
}
/** The bytes of a file cannot be used: its status_name is that of the defect, or "UnreadableMesh". */
export class FileError extends TandemError {}
/** The memory of the WebAssembly instance, at most 2 GiB, is at its end. */
export class MemoryError extends TandemError {}

/**
 * Loads the WebAssembly code, once. All else here may be used when the promise is kept.
 * source: a URL, relative to this module; the bytes; or a compiled module.
 */
export function load(source?: string | URL | BufferSource | WebAssembly.Module): Promise<void>;

/** The version of the library, such as "0.1.0". */
export function version(): string;

/** Rows of an answer, in memory that belongs to the caller. */
export interface Rows<Row> extends Iterable<Row> {
  readonly length: number;
  /** The rows as they lie in tandem.h, for another thread or a file. */
  readonly bytes: Uint8Array;
  at(row: number): Row | undefined;
  /** A field of all rows; of a field that is an array, its numbers row by row. */
  column(field: keyof Row): Uint8Array | Uint32Array | Int32Array | Float32Array | Float64Array | BigUint64Array;
}

type Vector = ArrayLike<number>;
type Vectors = ArrayLike<number> | number[][];

/** The place of a body: world = rotation x + translation. Rotations are to be rigid to 1e-6; a quaternion may have any length but 0. */
export interface Pose {
  /** Three rows of three numbers, or nine. */
  rotation?: number[][] | ArrayLike<number>;
  xyzw?: number[];
  wxyz?: number[];
  translation?: number[];
  /** Three or four rows of four numbers, or all of these one after the other, instead of a rotation and a translation. */
  transform?: number[][] | ArrayLike<number>;
}
/** An asset as a body. asset: its place in the scene's list; 0 where it is not given. */
export interface Body extends Pose {
  asset?: number;
}
export function rotations(quaternion: { xyzw: number[] } | { wxyz: number[] }): number[][];

/** A level of detail; level 0 is the finest. */
export interface Level {
  readonly triangle_count: number;
  readonly block_count: number;
  readonly leaf_block_count: number;
  /** This is the depth of the tree, in blocks. */
  readonly depth: number;
  /** No point of this surface or of the file's finest is farther from the other. */
  readonly error_bound: number;
  readonly has_oriented_blocks: boolean;
  readonly has_topology: boolean;
  readonly vertex_count: number;
  readonly component_count: number;
  /** Says whether all components are closed. */
  readonly closed: boolean;
}
export interface Part {
  name: string;
  /** The names of scene nodes, joined by "/". */
  path: string;
  first_face: number;
  face_count: number;
}
/** A box in the coordinates of the mesh file. */
export interface Box {
  lower: number[];
  upper: number[];
}
/** A node of a tree. index: its child block, or the triangle of a leaf. */
export interface Node extends Box {
  depth: number;
  is_leaf: boolean;
  index: number;
}

/** The checked contents of one .bvh file. It never changes. */
export class Asset {
  private constructor();
  /**
   * Checks the bytes of a .bvh file, and copies them. Throws FileError. check: "quick" believes what oriented boxes hold and what topology
   * says; nothing is read out of bounds.
   */
  static from_bytes(data: BufferSource, options?: { check?: "full" | "quick" }): Asset;
  /** Frees the asset once no scene has it. Without this call it is freed some time after nothing refers to it. */
  delete(): void;
  /** The bytes of the file, without a copy: of use until the library's memory grows, which any call may do. */
  readonly data: Uint8Array;
  readonly levels: readonly Level[];
  readonly first_level: number;
  readonly origin: number[];
  readonly bounds: Box;
  /** This is the text that bvhinfo prints. */
  readonly hash: string;
  readonly file_bytes: number;
  readonly source_faces: number;
  readonly source_vertices: number;
  readonly rounding_error: number;
  /** Says how the file was made. */
  readonly provenance: unknown;
  /** The corners of a level's triangles, nine numbers each, in the mesh file's coordinates; triangles as contacts number them. */
  triangles(level?: number): Float64Array;
  /** The face of the mesh file that each triangle comes from. */
  faces(level?: number): Uint32Array;
  /** The coarsest level whose error_bound is at most `tolerance`; 0 where none is. */
  coarsest_level(tolerance: number): number;
  /** An asset that shows `count` levels of this one from level `first` on; 0: all. The bytes are shared. */
  levels_from(first: number, count?: number): Asset;
  /** The boxes of the tree's nodes at a depth: 0, one around everything; 1, the nodes of the root block; and so on. */
  boxes(depth: number, level?: number): Box[];
  /** The nodes of all depths whose boxes contain a point, in the mesh file's coordinates. */
  boxes_around(point: Vector, level?: number): Node[];
}

/** The contents of a mesh file: `build(mesh.vertices, mesh.triangles, mesh)` is what bvhbuild makes of it. */
export interface Mesh {
  /** Three numbers each. */
  vertices: Float64Array;
  /** Three vertices each: the file's faces, quads cut in two. */
  triangles: Uint32Array;
  /** The face of the file that each triangle is a piece of. */
  face_ids: Uint32Array;
  parts: Part[];
  /** Oddities, for people. */
  remarks: string[];
}
/**
 * Reads an OBJ, PLY, STL, OFF, glTF or GLB file of triangles and quads, as bvhbuild does. name: the file's, whose ending says its kind.
 * Throws FileError, whose text says why, with the line where there is one.
 */
export function read_mesh(data: BufferSource, name?: string): Mesh;

export interface BuildOptions {
  effort?: "default" | "fast" | "best";
  /** With the blocks that exact queries on a GPU walk. */
  gpu_blocks?: boolean;
  /** With what manifolds and contained bodies need. */
  topology?: boolean;
  refit?: boolean;
  imaginary_share?: number;
  face_ids?: ArrayLike<number>;
  parts?: Part[];
  /** JSON that the file says of its making. */
  provenance?: string;
}
/** Builds an asset: the bytes that bvhbuild writes for these faces, but for what they say of their making. */
export function build(vertices: Vectors, faces: Vectors, options?: BuildOptions): Asset;

type Pairs = Iterable<[number, number] | ObjectPair>;

export interface ContactOptions {
  pairs?: Pairs;
  mode?: "exact" | "fast" | "boxes";
  first_contact_only?: boolean;
  self_pairs?: boolean;
  within?: number;
  add_error_bounds?: boolean;
  leave_out_rings?: number;
}
export interface DistanceOptions {
  pairs?: Pairs;
  reach?: number;
  absolute_tolerance?: number;
  relative_tolerance?: number;
  /** By ascending a, then b: triangles that were nearest a step ago, where to begin to look. */
  former?: Iterable<FormerNearest>;
}
export interface ClosestOptions {
  reach?: number;
  absolute_tolerance?: number;
  relative_tolerance?: number;
  sides?: boolean;
}

/** Posed meshes, of which any number of questions can be asked. docs/python.md says what each one answers. */
export class Scene {
  constructor(assets: Asset[], bodies?: Body[]);
  /** Frees the scene. Without this call it is freed some time after nothing refers to it. */
  delete(): void;
  /** Places all bodies anew. Throws TandemError, where `where` is the body; there are no bodies then. */
  place(bodies: Body[]): this;
  /** Moves a body and leaves the others alone. */
  move(body: number, pose: Pose): void;
  /** Finds every pair of triangles that meet. */
  contacts(options?: ContactOptions): { pairs: Rows<ObjectPair>; contacts: Rows<Contact>; counters: ContactCounters };
  /** Makes manifolds of the contacts that were found last. */
  manifolds(options?: { most_points?: number; match_previous?: boolean; quick_depths?: boolean }): {
    pairs: Rows<ObjectPair>; manifolds: Rows<Manifold>; points: Rows<ManifoldPoint>; counters: ManifoldCounters;
  };
  contained(): { pairs: Rows<ObjectPair>; contained: Rows<Containment>; counters: ContainmentCounters };
  distances(options?: DistanceOptions): { pairs: Rows<ObjectPair>; distances: Rows<Distance>; counters: DistanceCounters };
  impacts(motion: Iterable<Motion>, duration: number, options?: { pairs?: Pairs; tolerance?: number }): {
    pairs: Rows<ObjectPair>; impacts: Rows<Impact>; counters: ImpactCounters;
  };
  verdicts(options: { tolerance: number; pairs?: Pairs }): { pairs: Rows<ObjectPair>; verdicts: Rows<Verdict>; counters: ToleranceCounters };
  closest(points: Vectors, options?: ClosestOptions): { closest: Rows<ClosestPoint>; counters: ClosestCounters };
  rays(origins: Vectors, directions: Vectors, options?: { reach?: number; hits?: "first" | "any" | "all" }): { rays: Rows<RayHit>; counters: RayCounters };
}
