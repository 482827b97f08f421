// The paper's correction while a border's points are being dragged: computed here in the same frame, until the server
// answers.
import { leastSquares } from "./live_curve.js";

/** @typedef {import("../../core/types").Border} Border @typedef {import("../../core/types").Point} Point
 * @typedef {import("../../core/types").Mesh} Mesh
 * @typedef {{ coefficients: number[], centre: number, scale: number }} Curve of the model's parameters
 * @typedef {Record<Border, Curve> & { width_px: number, height_px: number }} Borders the model's parameters */

const REACH = 1, // how far beyond the picture a border is extrapolated, as a share of the picture's extent
  MIN_EXTENT_PX = 1; // borders nearer than this have met

/**
 * The nodes of a mesh of the paper's model, its borders bent to where their points are now: each keeps its degree. Null
 * where points do not determine a border.
 *
 * Eq. (4) and (8), solved for the raw pixel; numbers in polynomial.py.
 * @param {Mesh} mesh of the last answer @param {Borders} model its parameters
 * @param {Record<Border, Point[]>} points of each border, strays left out
 * @returns {Mesh | null}
 */
export function bentMesh(mesh, model, points) {
  const left = through(model.left, points.left, ([x, y]) => [y, x]),
    right = through(model.right, points.right, ([x, y]) => [y, x]);
  if (!left || !right) return null;
  /** Points on a border that runs across, at their corrected columns. @param {Point} point @returns {Point} */
  const columned = ([x, y]) => [((x - left(y)) * model.width_px) / (right(y) - left(y)), y];
  const top = through(model.top, points.top, columned),
    bottom = through(model.bottom, points.bottom, columned);
  if (!top || !bottom) return null;
  const { columns, rows, first, step, image_size } = mesh,
    nodes = new Float32Array(2 * columns * rows),
    middle = (image_size[1] - 1) / 2;
  for (let i = 0; i < columns; i++) {
    const column = first[0] + i * step[0],
      begin = top(column),
      height = bottom(column) - begin,
      isNear = height >= MIN_EXTENT_PX && Math.abs(column / model.width_px - 0.5) <= 0.5 + REACH;
    for (let j = 0; j < rows; j++) {
      const y = begin + ((first[1] + j * step[1]) * height) / model.height_px,
        from = left(y),
        width = right(y) - from,
        isReached =
          isNear && width >= MIN_EXTENT_PX && Math.abs(y - middle) <= (0.5 + REACH) * image_size[1];
      const at = 2 * (j * columns + i);
      nodes[at] = isReached ? from + (column * width) / model.width_px : NaN;
      nodes[at + 1] = isReached ? y : NaN;
    }
  }
  return { ...mesh, nodes };
}

/**
 * A border's curve through its points, of the degree that it has.
 * @param {Curve} curve @param {Point[]} points @param {(point: Point) => Point} placed its position and value
 */
function through({ coefficients, centre, scale }, points, placed) {
  const pairs = points.map(placed),
    fit = leastSquares(
      pairs.map(([position]) => (position - centre) / scale),
      pairs.map(([, value]) => value),
      coefficients.length - 1,
    );
  return fit && ((/** @type {number} */ position) => fit((position - centre) / scale));
}
