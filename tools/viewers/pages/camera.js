// COLMAP's cameras as WebGL's viewers want them: y up, z backward.

const [NEAR, FAR] = [0.01, 1000];

/** The camera's placing in the world, 4×4 by columns: the inverse of diag(1, −1, −1) · [R | t]. */
export function worldMatrix({ rotation: r, translation: t }) {
  const axis = (row, sign) => r[row].map((value) => sign * value);
  const [x, y, z] = [axis(0, 1), axis(1, -1), axis(2, -1)];
  const center = [0, 1, 2].map((k) => -(r[0][k] * t[0] + r[1][k] * t[1] + r[2][k] * t[2]));
  return [...x, 0, ...y, 0, ...z, 0, ...center, 1];
}

/** The projection, 4×4 by columns. */
export function projectionMatrix({ width, height, fx, fy, cx, cy }) {
  return [
    2 * fx / width, 0, 0, 0,
    0, 2 * fy / height, 0, 0,
    1 - 2 * cx / width, 2 * cy / height - 1, -(FAR + NEAR) / (FAR - NEAR), -1,
    0, 0, -2 * FAR * NEAR / (FAR - NEAR), 0,
  ];
}

/** Gives a camera of three.js the place and lens of a view. */
export function take(camera, view) {
  camera.matrix.fromArray(worldMatrix(view));
  camera.matrixWorld.copy(camera.matrix);
  camera.matrixWorldInverse.copy(camera.matrixWorld).invert();
  camera.projectionMatrix.fromArray(projectionMatrix(view));
  camera.projectionMatrixInverse.copy(camera.projectionMatrix).invert();
}

export { NEAR, FAR };
