// The curve of a border whose points are being dragged: computed here in the same frame, until the server answers.

/** @typedef {import("../../core/types").Curve} Curve @typedef {import("../../core/types").Point} Point */

const MIN_SPREAD = 1e-12; // of the positions' spread: less, and the points do not determine the next term

/**
 * The last answer's curve, bent to where its points are now: its degree, its strays left out. Null where the points do
 * not determine it.
 *
 * Least squares in polynomials that are orthogonal on the points themselves (Forsythe 1957: p_{k+1} = (t - a_k) p_k -
 * b_k p_{k-1}), which is what
 * the server's fit of that degree gives; whether a point is a stray, and the degree, remain for the server to say.
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
  const at = inside.map((p) => unit(p[run])),
    value = inside.map((p) => p[1 - run]);
  // The same polynomials where the curve is drawn and at every point, strays too.
  const places = [...drawn, ...points.map((p) => p[run])].map(unit),
    fitted = places.map(() => 0);
  let now = at.map(() => 1),
    before = at.map(() => 0),
    there = places.map(() => 1),
    thereBefore = places.map(() => 0),
    last = 1;
  for (let k = 0; k <= curve.degree; k++) {
    const norm = dot(now, now);
    if (!(norm > MIN_SPREAD * inside.length)) return null;
    const share = dot(now, value) / norm,
      a =
        dot(
          now.map((p, i) => p * at[i]),
          now,
        ) / norm,
      b = k ? norm / last : 0;
    for (const [i, p] of there.entries()) fitted[i] += share * p;
    [now, before] = [now.map((p, i) => (at[i] - a) * p - b * before[i]), now];
    [there, thereBefore] = [there.map((p, i) => (places[i] - a) * p - b * thereBefore[i]), there];
    last = norm;
  }
  if (!fitted.every(Number.isFinite)) return null;
  const residuals = points.map((p, i) => p[1 - run] - fitted[drawn.length + i]);
  return {
    ...curve,
    points,
    residuals_px: residuals,
    rms_px: Math.sqrt(residuals.reduce((sum, r, i) => sum + (strays.has(i) ? 0 : r * r), 0) / inside.length),
    curve: drawn.map((position, i) => (run ? [fitted[i], position] : [position, fitted[i]])),
  };
}

/** @param {number[]} a @param {number[]} b */
const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
