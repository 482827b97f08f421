// Finds the field's lines on the server: the job that looks for them, and its points in the draft in one step.
import { signal } from "@preact/signals";
import { change, doc, withModel } from "../../core/document.js";
import { runJob } from "../../core/jobs.js";
import { longWork } from "../../core/long_work.js";
import { model, models, region, rotation, snapshot } from "../../core/state.js";

// judged by the first model that fits; a draft in which nobody has clicked yet takes that model too
const MODEL = "auto";

/** @typedef {{ level: string, sentence: string, fix: string, reason: string }} Verdict
 * @typedef {{ verdict: Verdict, observations: import("../../core/types").Observation[], model: string, report: unknown
 * }} FoundLines */

const work = longWork();
/** How far the search is, and why it was refused. */
export const { search: finding, refusal: notFound } = work;
/** What the last search says of which picture, and how many points it gave. */
export const lastFound = signal(
  /** @type {{ picture: string, verdict: Verdict, points: number } | null} */ (null),
);

/** Look for the lines in the picture; what is found goes into the draft, beside what is there. */
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
  lastFound.value = null;
  await work.watch(
    (stop, onProgress) => runJob("/calibrations/auto", body, stop, onProgress),
    (/** @type {FoundLines} */ found) => {
      if (snapshot.value?.id !== picture.id) return; // another picture by now: its draft is not ours
      const added = onUnclickedLines(found.observations),
        untouched = !doc.value.observations.some((o) => o.points.length);
      const fits = untouched && found.report ? models.value.find((m) => m.name === found.model) : null;
      const next = fits ? withModel(doc.value, fits, model.value) : doc.value;
      if (added.length) change({ ...next, observations: [...next.observations, ...added] });
      lastFound.value = {
        picture: picture.id,
        verdict: found.verdict,
        points: added.reduce((sum, o) => sum + o.points.length, 0),
      };
    },
  );
}

/**
 * What was found on lines that nobody has clicked: clicks are the operator's, and stay.
 * @param {import("../../core/types").Observation[]} found
 */
function onUnclickedLines(found) {
  const clicked = new Set(doc.value.observations.filter((o) => o.points.length).map((o) => String(o.feature)));
  return found.filter((o) => !clicked.has(String(o.feature)));
}

/** @type {import("../../core/actions.js").Action[]} */
export const FIND_LINES_ACTIONS = [
  {
    id: "find-lines",
    label: "Find the field's lines in the picture, without clicks",
    short: "Find the lines",
    group: "Points",
    run: () => void findLines(),
    enabled: () => snapshot.value !== null && region.value !== null && finding.value === null,
  },
  {
    id: "stop-lines",
    label: "Stop finding the lines",
    short: "Stop",
    group: "Points",
    run: () => finding.value?.stop.abort(),
    enabled: () => finding.value !== null,
  },
];
