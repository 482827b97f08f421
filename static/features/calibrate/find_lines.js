// Detects the field's lines on the server: by itself on an image without points. Points that the server is sure of go
// into the draft in one step; the others are offered.
import { computed, effect, signal, untracked } from "@preact/signals";
import { change, doc } from "../../core/document.js";
import { runJob } from "../../core/jobs.js";
import { longWork } from "../../core/long_work.js";
import { editing, field, region, rotation, snapshot } from "../../core/state.js";
import { t } from "../../core/words.js";
import { rememberDetected, withoutDetected } from "./detected_points.js";
import { draft } from "./draft.js";
import { preview } from "./fitting.js";
import { discardProposed, proposals } from "./line_suggestions.js";
import { others } from "./presence.js";

// judged by the first model that fits
const MODEL = "auto";

/** @typedef {{ level: string, sentence: string, fix: string, reason: string }} Verdict
 * @typedef {import("../../core/types").SeenArea} SeenArea
 * @typedef {{ verdict: Verdict, observations: import("../../core/types").Observation[], model: string, report: unknown,
 *   areas: SeenArea[] }} FoundLines */

const work = longWork();
/** How far the search is, and why it was refused. */
export const { search: finding, refusal: notFound } = work;
const found = signal(
  /** @type {(Pick<FoundLines, "verdict" | "areas"> & { of: import("../../core/types").Doc, points: number }) | null} */
  (null),
);
/** What the last detection says, as long as the document is what it made of it: an undo takes it back too. */
export const lastFound = computed(() => (found.value?.of === doc.value ? found.value : null));

/** The areas that the image shows in place of the chosen one, as detected. */
export const detectedAreas = computed(() => lastFound.value?.areas ?? []);
/** The same, else as the points say. */
export const otherAreas = computed(() =>
  detectedAreas.value.length ? detectedAreas.value : (preview.value?.report.areas ?? []),
);

const KEPT = "touchline.detect";
/** Whether lines are detected without being asked. */
export const autoDetect = signal(localStorage.getItem(KEPT) !== "off");

export function toggleAutoDetect() {
  autoDetect.value = !autoDetect.value;
  try {
    localStorage.setItem(KEPT, autoDetect.value ? "on" : "off");
  } catch {
    /* until the reload, then */
  }
}

/** Look for the lines in the image; clicks that are there stay, what was detected before is replaced. */
export async function findLines() {
  const picture = snapshot.value,
    document = doc.value;
  if (!picture || !document.field || !region.value || finding.value) return;
  const body = {
    snapshot: picture.id,
    field: document.field,
    region: region.value.name,
    rotate: rotation.value,
    model: MODEL,
    keep: false,
  };
  found.value = null;
  await work.watch(
    (stop, onProgress) => runJob("/calibrations/auto", body, stop, onProgress),
    (/** @type {FoundLines} */ { observations, verdict, areas }) => {
      if (snapshot.value?.id !== picture.id) return; // another picture by now: its draft is not ours
      const clicked = withoutDetected(picture.id, doc.value.observations),
        fresh = onUnclickedLines(observations, clicked),
        isSure = verdict.level !== "unsure" && verdict.level !== "nothing";
      if (!isSure)
        proposals.value = {
          along: false,
          items: fresh.map(({ feature, points }) => ({ feature: String(feature), points })),
        };
      else if (fresh.length) {
        change({ ...doc.value, observations: [...clicked, ...fresh] });
        rememberDetected(picture.id, fresh);
      }
      const points = isSure ? fresh.reduce((sum, o) => sum + o.points.length, 0) : 0;
      found.value = { of: doc.value, verdict, points, areas };
    },
  );
}

/** Detect by itself, from now on: once an image, field, area and rotation, where nobody has placed a point or is about
 * to. */
export function startDetecting() {
  /** @type {Set<string>} */
  const tried = new Set();
  effect(() => {
    const picture = snapshot.value?.id,
      asked = [picture, doc.value.field, region.value?.name, rotation.value].join(" "),
      isWanted =
        editing.value &&
        region.value !== null &&
        draft.value.state === "saved" &&
        others.value.length === 0 &&
        doc.value.observations.length === 0 &&
        finding.value === null && // of an image that was left
        autoDetect.value;
    untracked(() => {
      if (!picture || !isWanted || tried.has(asked)) return;
      tried.add(asked);
      void findLines();
    });
  });
}

/**
 * What was found on lines that nobody has clicked: clicks are the operator's, and stay.
 * @param {import("../../core/types").Observation[]} detected @param {import("../../core/types").Observation[]} clicked
 */
function onUnclickedLines(detected, clicked) {
  const lines = new Set(clicked.filter((o) => o.points.length).map((o) => String(o.feature)));
  return detected.filter((o) => !lines.has(String(o.feature)));
}

/** The document over another field, area or rotation: points that were detected for the former go with it.
 * @param {Partial<import("../../core/types").Doc>} values */
export function changePlace(values) {
  if (!proposals.value.along) discardProposed();
  const observations = withoutDetected(snapshot.value?.id, values.observations ?? doc.value.observations);
  change({ ...doc.value, ...values, observations });
}

/** Choose an area that the image shows, and detect in it. @param {SeenArea} area */
export function chooseArea({ region: name, rotate }) {
  changePlace({ region: name, rotate: rotate === field.value?.regions[name]?.rotate ? null : rotate });
  if (!autoDetect.value || doc.value.observations.length) void findLines(); // else it begins by itself
}

/** @type {import("../../core/actions.js").Action[]} */
export const FIND_LINES_ACTIONS = [
  {
    id: "auto-detect",
    label: t("calibrate.find-lines.action.auto-detect"),
    short: t("calibrate.find-lines.action.auto-detect.short"),
    group: "points",
    run: toggleAutoDetect,
    pressed: () => autoDetect.value,
    enabled: () => editing.value,
  },
  {
    id: "find-lines",
    label: t("calibrate.find-lines.action.detect"),
    short: t("calibrate.find-lines.action.detect.short"),
    group: "points",
    run: () => void findLines(),
    enabled: () => snapshot.value !== null && region.value !== null && finding.value === null,
  },
  {
    id: "use-area",
    label: t("calibrate.find-lines.action.use-area"),
    group: "points",
    run: () => chooseArea(detectedAreas.value[0]),
    enabled: () => detectedAreas.value.length === 1,
  },
  {
    id: "stop-lines",
    label: t("calibrate.find-lines.action.stop"),
    short: t("common.stop"),
    group: "points",
    run: () => finding.value?.stop.abort(),
    enabled: () => finding.value !== null,
  },
];
