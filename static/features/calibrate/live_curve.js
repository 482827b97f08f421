// The curve of a border whose points are being dragged: computed here in the same frame, until the server answers.

/** @typedef {import("../../core/types").Curve} Curve @typedef {import("../../core/types").Point} Point */

const MIN_SPREAD = 1e-12; // of the positions' spread: less, and the points do not determine the next term

/**
 * The last answer's curve, bent to where its points are now: its degree, its strays left out. Null where the points do
 * not determine it.
 *
 * Whether a point is a stray, and the degree, remain for the server to say.
 * @param {Curve} curve @param {Point[]} points as many as the curve's own @param {0 | 1} run the axis of the positions:
 * 1 for a border that runs down the picture
 * @returns {Curve | null}
 */
export function curveThrough(curve, points, run) {
  const strays = new Set(curve.outliers),
    drawn = curve.curve.map((p) => p[run]);
  const inside = points.filter((_, i) => !strays.has(i));
  const from = Math.min(...drawn),
    half = (Math.max(...drawn) - from) / 2;
  const unit = (/** @type {number} */ position) => (position - from) / half - 1;
  const fit = leastSquares(
    inside.map((p) => unit(p[run])),
    inside.map((p) => p[1 - run]),
    curve.degree,
  );
  if (!fit) return null;
  // The same polynomial where the curve is drawn and at every point, strays too.
  const fitted = [...drawn, ...points.map((p) => p[run])].map((position) => fit(unit(position)));
  if (!fitted.every(Number.isFinite)) return null;
  const residuals = points.map((p, i) => p[1 - run] - fitted[drawn.length + i]);
  return {
    ...curve,
    points,
    residuals_px: residuals,
    rms_px: Math.sqrt(
      residuals.reduce((sum, r, i) => sum + (strays.has(i) ? 0 : r * r), 0) / inside.length,
    ),
    curve: drawn.map((position, i) => (run ? [fitted[i], position] : [position, fitted[i]])),
  };
}

/**
 * The polynomial of a degree through values at positions; null where they do not determine it.
 *
 * In polynomials that are orthogonal on the positions themselves (Forsythe 1957: p_{k+1} = (t - a_k) p_k - b_k
 * p_{k-1}), which is what the server's fit of that degree gives.
 * @param {number[]} at positions of about -1 to 1 @param {number[]} values @param {number} degree
 * @returns {((t: number) => number) | null}
 */
export function leastSquares(at, values, degree) {
  /** @type {{ a: number, b: number, share: number }[]} */
  const terms = [];
  let now = at.map(() => 1),
    before = at.map(() => 0),
    last = 1;
  for (let k = 0; k <= degree; k++) {
    const norm = dot(now, now);
    if (!(norm > MIN_SPREAD * at.length)) return null;
    const share = dot(now, values) / norm,
      a = now.reduce((sum, p, i) => sum + p * p * at[i], 0) / norm,
      b = k ? norm / last : 0;
    terms.push({ a, b, share });
    [now, before] = [now.map((p, i) => (at[i] - a) * p - b * before[i]), now];
    last = norm;
  }
  return (t) => {
    let value = 0,
      p = 1,
      previous = 0;
    for (const { a, b, share } of terms) {
      value += share * p;
      [p, previous] = [(t - a) * p - b * previous, p];
    }
    return value;
  };
}

/** @param {number[]} a @param {number[]} b */
const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
