// This is what is drawn, by three.js.
import * as THREE from "./three/three.module.js";

const colour_of = (name) => new THREE.Color(getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim());
const geometry_of = (positions) => new THREE.BufferGeometry().setAttribute("position", new THREE.BufferAttribute(Float32Array.from(positions), 3));
// The corners of a box that its twelve edges join: bit 0 is x, bit 1 y, bit 2 z.
const EDGES = [0, 1, 2, 3, 4, 5, 6, 7, 0, 2, 1, 3, 4, 6, 5, 7, 0, 4, 1, 5, 2, 6, 3, 7];

export class Picture {
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(40, 1, 0.01, 1000);
    this.camera.up.set(0, 0, 1);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x667788, 0.75));
    this.lamp = new THREE.DirectionalLight(0xffffff, 0.55);
    this.scene.add(this.lamp);
    this.slots = { a: this.#slot("mesh-a"), b: this.#slot("mesh-b") };
    this.materials = { normal: this.#line(), nearest: this.#line(), box: this.#line() };
    const dots = () => new THREE.PointsMaterial({ size: 7, sizeAttenuation: false, depthTest: false, transparent: true });
    this.dots = { normal: dots(), nearest: dots() };
    this.marks = new THREE.Group();
    this.scene.add(this.marks);
    this.recolour();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.recolour());
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.resize();
  }

  #line() {
    return new THREE.LineBasicMaterial({ depthTest: false, transparent: true });
  }

  #slot() {
    const group = new THREE.Group();
    group.matrixAutoUpdate = false;
    const material = new THREE.MeshPhongMaterial({ flatShading: true, side: THREE.DoubleSide, shininess: 12, specular: 0x222222 });
    // Triangles in contact are drawn again, a little nearer to the eye.
    const contact = new THREE.MeshBasicMaterial({ side: THREE.DoubleSide, polygonOffset: true, polygonOffsetFactor: -2, polygonOffsetUnits: -2 });
    const mesh = new THREE.Mesh(new THREE.BufferGeometry(), material);
    const touching = new THREE.Mesh(new THREE.BufferGeometry(), contact);
    touching.visible = mesh.visible = false;
    group.add(mesh, touching);
    this.scene.add(group);
    return { group, mesh, touching, positions: null };
  }

  recolour() {
    this.renderer.setClearColor(colour_of("stage"));
    for (const [slot, { mesh, touching }] of Object.entries(this.slots)) {
      mesh.material.color = colour_of(`mesh-${slot}`);
      touching.material.color = colour_of("contact");
    }
    for (const [name, material] of Object.entries(this.materials)) material.color = colour_of(name);
    for (const [name, material] of Object.entries(this.dots)) material.color = colour_of(name);
    this.draw();
  }

  resize() {
    const { clientWidth, clientHeight } = this.canvas.parentElement;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / Math.max(clientHeight, 1);
    if (this.view) this.look(this.view);
    this.draw();
  }

  set_mesh(slot, positions) {
    const { mesh, touching } = this.slots[slot];
    mesh.geometry.dispose();
    mesh.geometry = geometry_of(positions);
    mesh.geometry.computeVertexNormals();
    mesh.visible = true;
    touching.visible = false;
    this.slots[slot].positions = positions;
  }

  /** Places a mesh, whose centre is its origin: three rows of a rotation, and where the centre is. */
  place(slot, rotation, position) {
    const [x, y, z] = rotation;
    const { group } = this.slots[slot];
    group.matrix.set(...x, position[0], ...y, position[1], ...z, position[2], 0, 0, 0, 1);
    group.matrixWorldNeedsUpdate = true;
  }

  /** theta: about the vertical, z; phi: above the horizon; distance: that of a picture that is not narrower than high. */
  look(view) {
    this.view = view;
    const { camera } = this;
    const { target, theta, phi } = view;
    const distance = view.distance * Math.max(1, 1 / camera.aspect);
    const out = [Math.cos(phi) * Math.cos(theta), Math.cos(phi) * Math.sin(theta), Math.sin(phi)];
    camera.near = distance / 100;
    camera.far = distance * 100;
    camera.position.set(...target.map((x, i) => x + distance * out[i]));
    camera.lookAt(...target);
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
    this.lamp.position.copy(camera.position);
  }

  /** The directions right, up and towards the eye. */
  axes() {
    const { elements } = this.camera.matrixWorld;
    return [0, 4, 8].map((column) => [0, 1, 2].map((row) => elements[column + row]));
  }

  /** The ray through a point of the picture, from -1 to 1. */
  ray(x, y) {
    const through = new THREE.Vector3(x, y, 0.5).unproject(this.camera).sub(this.camera.position).normalize();
    return { origin: this.camera.position.toArray(), direction: through.toArray() };
  }

  show_contacts(slot, triangles) {
    const { touching, positions } = this.slots[slot];
    const corners = new Float32Array(9 * triangles.length);
    triangles.forEach((triangle, i) => corners.set(positions.subarray(9 * triangle, 9 * triangle + 9), 9 * i));
    touching.geometry.dispose();
    touching.geometry = geometry_of(corners);
    touching.visible = triangles.length > 0;
  }

  clear_marks() {
    for (const mark of [...this.marks.children]) {
      this.marks.remove(mark);
      mark.geometry.dispose();
    }
  }

  #mark(object) {
    object.renderOrder = 1;
    object.frustumCulled = false;
    this.marks.add(object);
  }

  add_lines(name, ends) {
    if (ends.length > 0) this.#mark(new THREE.LineSegments(geometry_of(ends.flat(Infinity)), this.materials[name]));
  }

  add_points(name, places) {
    if (places.length > 0) this.#mark(new THREE.Points(geometry_of(places.flat()), this.dots[name]));
  }

  /** boxes: with corners that `to_world` takes to where they are. */
  add_boxes(boxes, to_world) {
    const ends = boxes.flatMap(({ lower, upper }) => EDGES.map((corner) => to_world([0, 1, 2].map((axis) => ((corner >> axis) & 1 ? upper : lower)[axis]))));
    this.add_lines("box", ends);
  }

  /** Draws at the next frame. */
  draw() {
    this.wanted ??= requestAnimationFrame(() => {
      this.wanted = undefined;
      this.renderer.render(this.scene, this.camera);
    });
  }
}
