// Evaluates a pair on the server: agreement of two cameras after every change, and epipolar lines at pointer rate.
import { computed, effect, signal, untracked } from "@preact/signals";
import { ServerUnreachable, call, online, toRefusal } from "../../core/api.js";
import { isEqual } from "../../core/history.js";
import { latestWins } from "../../core/latest_wins.js";
import { t } from "../../core/words.js";
import {
  ENOUGH,
  SIDES,
  atPair,
  both,
  calibrations,
  chosen,
  complete,
  missing,
  other,
  pair,
  pictures,
  pointed,
  views,
} from "./pair.js";

/**
 * @typedef {import("./types").PairAnswer} PairAnswer
 * @typedef {import("./types").PairLines} PairLines
 * @typedef {import("./types").Side} Side
 * @typedef {import("./types").Question} Question
 */

const REACH_PX = 14; // how near the pointer must be to a mark to mean it

/** The newest answer, or why there is none; `of` says to which question. */
const answer = signal(
  /**
   * @type {{ of: string, asked: Question, found: PairAnswer | null, refusal: import("../../core/types").Refusal | null
   *   } | null}
   */ (
    null
  ),
);
/** Whose lines are wanted, where both can be had. */
export const chosenBasis = signal(/** @type {"matches" | "calibrations"} */ ("matches"));
const drawn = signal(/** @type {{ index: number, by: string, lines: PairLines } | null} */ (null));

const question = computed(() => {
  const { a, b } = calibrations.value,
    { matches } = pair.doc.value,
    calibrated = a !== null && b !== null;
  if (!atPair.value || !both.value || (!calibrated && complete.value < ENOUGH)) return null;
  const points = complete.value
    ? { points_a: matches.map((m) => m.a), points_b: matches.map((m) => m.b), z_mm: matches.map((m) => m.z_mm) }
    : {};
  return { ...points, ...(calibrated ? { calibration_a: a.id, calibration_b: b.id } : {}) };
});
const asked = computed(() => JSON.stringify(question.value));

/** What the server says of this pair: of the matches as they are, or, until the answer comes, as they were. */
export const pairAnswer = computed(() => (question.value ? (answer.value?.found ?? null) : null));
export const refusal = computed(() =>
  question.value && answer.value?.of === asked.value ? answer.value.refusal : null,
);
export const stale = computed(() => question.value !== null && answer.value?.of !== asked.value);

/** What each match is worth: its distance from its lines, whether it is a mistake, and how far apart it is placed. */
export const matchErrors = computed(() =>
  pair.doc.value.matches.map((match, i) => {
    const now = answer.value?.asked,
      isThis = isEqual(now?.points_a?.[i], match.a) && isEqual(now?.points_b?.[i], match.b);
    const it = isThis ? pairAnswer.value : null,
      geometry = it?.fundamental;
    return {
      px: (geometry ?? it?.calibrated)?.epipolar_px[i] ?? null,
      mm: it?.agreement?.apart_mm?.[i] ?? null,
      isMistake: geometry?.outliers.includes(i) ?? false,
    };
  }),
);

/** The match that is worst: farthest from its line, else farthest apart. */
export const worstMatch = computed(() => {
  const by = (/** @type {"px" | "mm"} */ what) =>
    matchErrors.value.reduce(
      (best, w, i) => ((w[what] ?? -1) > (matchErrors.value[best]?.[what] ?? -1) ? i : best),
      -1,
    );
  return by("px") >= 0 ? by("px") : by("mm");
});

/** The match under the pointer. */
export const hoveredMatch = computed(() => {
  const at = pointed.value;
  if (!at || at.touch) return null;
  const reach = REACH_PX / views[at.side].view.value.k;
  const index = pair.doc.value.matches.findIndex((m) => {
    const p = m[at.side];
    return p !== null && Math.hypot(p[0] - at.x, p[1] - at.y) < reach;
  });
  return index < 0 ? null : index;
});

/** Whose epipolar lines are drawn: the match under the pointer, else the chosen one. */
export const linedMatch = computed(
  () => (pointed.value?.down ? chosen.value?.index : (hoveredMatch.value ?? chosen.value?.index)) ?? null,
);

/** What can tell lines now: a matrix from matches, or two calibrations. */
export const linesBases = computed(() => {
  const matrix = pairAnswer.value?.fundamental?.matrix,
    { a, b } = calibrations.value;
  return {
    matches: matrix ?? null,
    calibrations: a && b ? { calibration_a: a.id, calibration_b: b.id } : null,
  };
});
export const linesBasis = computed(() =>
  linesBases.value[chosenBasis.value]
    ? chosenBasis.value
    : linesBases.value.matches
      ? "matches"
      : linesBases.value.calibrations
        ? "calibrations"
        : null,
);

const linesWanted = computed(() => {
  const index = linedMatch.value,
    match = index === null ? null : pair.doc.value.matches[index],
    { a, b } = pictures.value;
  if (!atPair.value || index === null || !match || !linesBasis.value || !a || !b) return null;
  const geometry =
    linesBasis.value === "matches"
      ? {
          matrix: linesBases.value.matches,
          image_size_a: [a.width, a.height],
          image_size_b: [b.width, b.height],
        }
      : { ...linesBases.value.calibrations, z_mm: match.z_mm };
  return {
    index,
    by: linesBasis.value,
    body: { ...geometry, points_a: match.a ? [match.a] : [], points_b: match.b ? [match.b] : [] },
  };
});

/**
 * The lines to draw now: in each picture that of the match's point in the other one, and where that one is foretold.
 */
export const epipolarLines = computed(() => {
  const it = drawn.value;
  if (!it || it.index !== linesWanted.value?.index || it.by !== linesWanted.value?.by)
    return { a: null, b: null };
  const match = pair.doc.value.matches[it.index];
  const of = (/** @type {Side} */ s) => ({
    line: (match?.[other(s)] && it.lines[`in_${s}`]?.[0]) || null,
    place: (match?.[other(s)] && it.lines[`place_in_${s}`]?.[0]) || null,
  });
  return { a: of("a"), b: of("b") };
});

/** Where the operator stands, and the next thing to do. */
export const pairNextStep = computed(() => {
  const lacking = SIDES.find((s) => !pictures.value[s]),
    why = missing.value;
  if (lacking)
    return {
      action: "open",
      label: t(`pair.step.open.${lacking}`),
      missing: "",
      done: false,
      sentence: why,
    };
  const said =
    why ||
    (stale.value
      ? t("common.server-busy")
      : complete.value
        ? t("pair.step.matches-say", { count: complete.value })
        : t("pair.step.calibrations-say"));
  return {
    action: "worst-match",
    label: t("pair.step.worst"),
    missing: worstMatch.value < 0 ? why || t("pair.step.match-something") : "",
    done: !why,
    sentence: said,
  };
});

const ask = latestWins(async (/** @type {string} */ of) => {
  try {
    answer.value = {
      of,
      asked: JSON.parse(of),
      found: await call("POST", "/pairs", JSON.parse(of)),
      refusal: null,
    };
  } catch (error) {
    if (!(error instanceof ServerUnreachable))
      answer.value = { of, asked: JSON.parse(of), found: null, refusal: toRefusal(error) };
  }
});

const askLines = latestWins(
  async (/** @type {{ index: number, by: string, body: unknown }} */ { index, by: basis, body }) => {
    try {
      drawn.value = { index, by: basis, lines: await call("POST", "/pairs/lines", body) };
    } catch (error) {
      // what cannot be drawn stands in words beside the pictures
      if (!(error instanceof ServerUnreachable)) drawn.value = null;
    }
  },
);

/** Ask after every change, from now on. */
export function startEvaluation() {
  effect(() => {
    const of = asked.value,
      isWanted = question.value !== null && online.value && !pair.dragging.value;
    untracked(() => {
      if (isWanted && answer.value?.of !== of) void ask(of);
    });
  });
  effect(() => {
    const wanted = linesWanted.value;
    if (wanted && online.value) untracked(() => void askLines(wanted));
  });
  effect(() => {
    // another pair's figures are no earlier ones of this
    void SIDES.map((s) => pictures.value[s]?.id);
    untracked(() => {
      answer.value = null;
      drawn.value = null;
    });
  });
}
