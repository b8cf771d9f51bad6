/** A sphere of radius 1, turned a little so that no vertex lies on an axis: a grid of about so many triangles. */
export function sphere(triangles) {
  const rows = Math.max(3, Math.round(Math.sqrt(triangles) / 2));
  const columns = 2 * rows;
  const vertices = [0, 0, 1];
  for (let row = 1; row < rows; ++row) {
    for (let column = 0; column < columns; ++column) {
      const [polar, around] = [(Math.PI * row) / rows, (2 * Math.PI * (column + (row % 2) / 2)) / columns];
      vertices.push(Math.sin(polar) * Math.cos(around), Math.sin(polar) * Math.sin(around), Math.cos(polar));
    }
  }
  vertices.push(0, 0, -1);
  const last = vertices.length / 3 - 1;
  const at = (row, column) => 1 + (row - 1) * columns + (column % columns);
  const faces = [];
  for (let column = 0; column < columns; ++column) {
    faces.push(0, at(1, column), at(1, column + 1), last, at(rows - 1, column + 1), at(rows - 1, column));
    for (let row = 1; row < rows - 1; ++row) {
      faces.push(at(row, column), at(row + 1, column), at(row, column + 1), at(row, column + 1), at(row + 1, column), at(row + 1, column + 1));
    }
  }
  return { vertices: Float64Array.from(vertices), faces: Uint32Array.from(faces) };
}
