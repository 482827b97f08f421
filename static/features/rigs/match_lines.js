// What two calibrations say of matches: epipolar lines at pointer rate, and how far off each was in the last check.
import { computed, effect, signal, untracked } from "@preact/signals";
import { ServerUnreachable, call, online } from "../../core/api.js";
import { latestWins } from "../../core/latest_wins.js";
import {
  atDesk,
  checked,
  chosen,
  desk,
  members,
  other,
  pointed,
  sent,
  views,
} from "./match_desk.js";

/** @typedef {import("./types").Side} Side @typedef {import("./types").Match} Match */

const REACH_PX = 14; // how near the pointer must be to a mark to mean it

/** @param {unknown} a @param {unknown} b @param {number | null} z_mm */
const named = (a, b, z_mm) => JSON.stringify([a, b, z_mm]);

/** By the match itself, so that a figure stays while others are removed, and goes when its match is moved. */
const figures = computed(() => {
  const asked = sent.value,
    told = checked.value?.matches;
  if (!asked || !told || !("calibrated" in told)) return new Map();
  return new Map(
    asked.points_a.map((a, i) => [
      named(a, asked.points_b[i], asked.z_mm[i]),
      {
        px: told.calibrated?.epipolar_px[i] ?? null,
        mm: told.agreement?.apart_mm?.[i] ?? null,
        isMistake: told.fundamental?.outliers.includes(i) ?? false,
      },
    ]),
  );
});
const UNKNOWN = {
  px: /** @type {number | null} */ (null),
  mm: /** @type {number | null} */ (null),
  isMistake: false,
};
/** Of each match: its distance from its lines, how far apart it is placed, and whether it contradicts the others. */
export const matchErrors = computed(() =>
  desk.doc.value.matches.map(
    (m) => /** @type {typeof UNKNOWN} */ (figures.value.get(named(m.a, m.b, m.z_mm)) ?? UNKNOWN),
  ),
);

/** The match that is worst: farthest from its line, else farthest apart; -1 where nothing is known. */
export const worstMatch = computed(() => {
  const by = (/** @type {"px" | "mm"} */ what) =>
    matchErrors.value.reduce(
      (best, it, i, all) => ((it[what] ?? -1) > (all[best]?.[what] ?? -1) ? i : best),
      -1,
    );
  return by("px") >= 0 ? by("px") : by("mm");
});

/** The match under the pointer. */
export const hoveredMatch = computed(() => {
  const at = pointed.value;
  if (!at || at.touch) return null;
  const reach = REACH_PX / views[at.side].view.value.k;
  const index = desk.doc.value.matches.findIndex((m) => {
    const p = m[at.side];
    return p !== null && Math.hypot(p[0] - at.x, p[1] - at.y) < reach;
  });
  return index < 0 ? null : index;
});

/** Whose epipolar lines are drawn: the match under the pointer, else the chosen one. */
export const linedMatch = computed(
  () =>
    (pointed.value?.down ? chosen.value?.index : (hoveredMatch.value ?? chosen.value?.index)) ??
    null,
);

const linesWanted = computed(() => {
  const index = linedMatch.value,
    match = index === null ? null : desk.doc.value.matches[index],
    { a, b } = members.value ?? {};
  if (!atDesk.value || !match || !a?.calibration || !b?.calibration) return null;
  const body = {
    calibration_a: a.calibration,
    calibration_b: b.calibration,
    z_mm: match.z_mm,
    points_a: match.a ? [match.a] : [],
    points_b: match.b ? [match.b] : [],
  };
  return { index, body };
});
const drawn = signal(
  /** @type {{ index: number | null, lines: import("./types").PairLines } | null} */ (null),
);

/** To draw now: in each image the line of the match's point in the other one, and where that one is predicted. */
export const epipolarLines = computed(() => {
  const it = drawn.value,
    match =
      it && it.index === linesWanted.value?.index ? desk.doc.value.matches[it.index ?? -1] : null;
  const of = (/** @type {Side} */ s) =>
    match?.[other(s)]
      ? { line: it?.lines[`in_${s}`]?.[0] ?? null, place: it?.lines[`place_in_${s}`]?.[0] ?? null }
      : { line: null, place: null };
  return { a: of("a"), b: of("b") };
});

const ask = latestWins(
  async (/** @type {NonNullable<typeof linesWanted.value>} */ { index, body }) => {
    try {
      drawn.value = { index, lines: await call("POST", "/pairs/lines", body) };
    } catch (error) {
      // why there are none is said by the rig and its check
      if (!(error instanceof ServerUnreachable)) drawn.value = null;
    }
  },
);

/** Ask for lines as they are wanted, from now on. */
export function startMatchLines() {
  effect(() => {
    const now = linesWanted.value;
    if (now && online.value) untracked(() => void ask(now));
  });
}
