// Which points of a picture were detected: they belong to the field, the area and the rotation that was searched for,
// and go when one of these is changed. Clicked points, and detected ones that the operator has touched, stay.

/** @typedef {import("../../core/types").Observation} Observation */

const KEPT = "touchline.detected",
  MOST = 20; // pictures

/** By picture, by feature: what its points were. Kept over a reload. @returns {[string, Record<string, string>][]} */
function known() {
  try {
    const kept = JSON.parse(localStorage.getItem(KEPT) ?? "[]");
    return Array.isArray(kept) ? kept : [];
  } catch {
    return [];
  }
}

/** @param {Observation} it */
const fingerprint = ({ points }) =>
  [0, 1].map((axis) => points.reduce((sum, p) => sum + p[axis], 0).toFixed(2)).join(" ") +
  ` of ${points.length}`;

/** @param {string} picture @param {Observation[]} observations */
export function rememberDetected(picture, observations) {
  const own = Object.fromEntries(observations.map((o) => [String(o.feature), fingerprint(o)])),
    others = known().filter(([id]) => id !== picture);
  try {
    localStorage.setItem(KEPT, JSON.stringify([[picture, own], ...others].slice(0, MOST)));
  } catch {
    /* then they count as clicked, and stay */
  }
}

/** What remains without the points that were detected in the picture. @param {string | undefined} picture
 * @param {Observation[]} observations */
export function withoutDetected(picture, observations) {
  const own = known().find(([id]) => id === picture)?.[1] ?? {};
  return observations.filter((o) => own[String(o.feature)] !== fingerprint(o));
}
