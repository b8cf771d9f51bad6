// Rotations as quaternions x, y, z, w, and the pose of a mesh that turns about its centre.
export function turned(q, axis, angle) {
  const s = Math.sin(angle / 2), length = Math.hypot(...axis) || 1;
  const [x, y, z] = axis.map((part) => (part / length) * s), w = Math.cos(angle / 2);
  const [a, b, c, d] = q;
  const made = [w * a + x * d + y * c - z * b, w * b - x * c + y * d + z * a, w * c + x * b - y * a + z * d, w * d - x * a - y * b - z * c];
  const size = Math.hypot(...made);
  return made.map((part) => part / size);
}

export function matrix_of([x, y, z, w]) {
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
    [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
    [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
  ];
}

/** The pose at which the mesh's centre is at `position`. */
export function pose_about(centre, q, position) {
  const rotation = matrix_of(q);
  return { rotation, translation: position.map((x, row) => x - rotation[row].reduce((sum, part, k) => sum + part * centre[k], 0)) };
}

/** Returns where a point of a mesh is in the world. */
export function placed(pose, point) {
  return pose.rotation.map((row, i) => row.reduce((sum, part, k) => sum + part * point[k], 0) + pose.translation[i]);
}
