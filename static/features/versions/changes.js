// What each version changed against the one before it: asked for once it is in sight.
import { signal } from "@preact/signals";
import { Problem, call } from "../../core/api.js";

/** @typedef {import("../../core/types").Point} Point @typedef {import("./types").VersionDifference} Difference */

const COLUMNS = 7,
  ROWS = 5; // of arrows
const LONGEST = 0.9; // of the distance of two arrows

/** By the two ids, the former first: the difference, or why there is none. Neither ever changes. */
export const changes = signal(
  /** @type {Map<string, { is: Difference | null, why: string }>} */ (new Map()),
);
const asked = new Set();

/** @param {string} before @param {string} id */
export const pairOf = (before, id) => `${before} ${id}`;

/** @param {string} before @param {string} id */
export async function loadChange(before, id) {
  const pair = pairOf(before, id);
  if (asked.has(pair)) return;
  asked.add(pair);
  let is = null,
    why = "";
  try {
    is = await call("GET", `/calibrations/${before}/difference/${id}.json`);
  } catch (error) {
    why = error instanceof Error ? error.message : String(error);
    // the server was away: it is asked for again when it is next in sight
    if (!(error instanceof Problem)) asked.delete(pair);
  }
  changes.value = new Map(changes.value).set(pair, { is, why });
}

/**
 * Arrows on the area, in a box of that size: where a place is in the former version, and how far it went. The longest
 * is nearly as long as two are apart.
 * @param {NonNullable<Difference["grid"]>} grid
 * @param {number} width
 * @param {number} height
 * @returns {{ was: Point, now: Point, mm: number }[]}
 */
export function arrowsOf({ places, mm, mm_vector: vectors }, width, height) {
  const rows = evenly(places.length, ROWS),
    columns = evenly(places[0].length, COLUMNS);
  const found = rows.flatMap((r) =>
    columns.flatMap((c) => {
      const [x, y] = vectors[r][c],
        far = mm[r][c];
      return x === null || y === null || far === null ? [] : [{ place: places[r][c], x, y, far }];
    }),
  );
  const xs = places.flat().map(([x]) => x),
    ys = places.flat().map(([, y]) => y);
  const [x0, x1, y0, y1] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  const k = Math.min(width / (x1 - x0), height / (y1 - y0)) * (1 - 1.5 / COLUMNS),
    most = Math.max(...found.map(({ far }) => far), 1e-9),
    times = (LONGEST * width) / COLUMNS / most;
  return found.map(({ place, x, y, far }) => {
    const was = /** @type {Point} */ ([
      width / 2 + k * (place[0] - (x0 + x1) / 2),
      height / 2 - k * (place[1] - (y0 + y1) / 2),
    ]);
    return { was, now: [was[0] + times * x, was[1] - times * y], mm: far };
  });
}

/** So many places of a count, each in the middle of its part. @param {number} count @param {number} wanted */
const evenly = (count, wanted) =>
  Array.from({ length: Math.min(wanted, count) }, (_, i) =>
    Math.floor(((i + 0.5) * count) / Math.min(wanted, count)),
  );
