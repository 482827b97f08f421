// Detects the field's lines on the server: by itself on an image without points. Points that the server is sure of go
// into the draft in one step; the others are offered. Where the field or the area is not chosen, the image tells it.
import { batch, computed, effect, signal, untracked } from "@preact/signals";
import { run } from "../../core/actions.js";
import { change, doc, isEqual } from "../../core/document.js";
import { runJob } from "../../core/jobs.js";
import { preference } from "../../core/preference.js";
import { longWork } from "../../core/long_work.js";
import { editing, field, fields, region, rotation, snapshot, step } from "../../core/state.js";
import { t } from "../../core/words.js";
import { draft } from "../calibrate/draft.js";
import { preview } from "../calibrate/fitting.js";
import { discardProposed, proposals } from "../calibrate/line_suggestions.js";
import { others } from "../calibrate/presence.js";
import { rememberDetected, withoutDetected } from "./detected_points.js";

const AUTOMATIC = "auto"; // of the model: the first that fits

/** @typedef {{ level: string, sentence: string, fix: string, reason: string }} Verdict
 * @typedef {import("../../core/types").SeenArea} SeenArea
 * @typedef {import("../../core/types").Doc} Doc
 * @typedef {SeenArea & { field: string, title: string }} FieldChoice a field, and a part of it, that an image may show
 * @typedef {{ verdict: Verdict, observations: import("../../core/types").Observation[], model: string, report: unknown,
 *   areas: SeenArea[], recognised?: { choices: FieldChoice[] } }} FoundLines */

const work = longWork();
/** How far the search is, and why it was refused. */
export const { search: finding, refusal: notFound } = work;
const found = signal(
  /** @type {(Pick<FoundLines, "verdict" | "areas"> & { of: Doc, points: number, choices: FieldChoice[] }) | null} */
  (null),
);
/** What the last detection says, as long as the document is what it made of it: an undo takes it back too. */
export const lastFound = computed(() => (found.value?.of === doc.value ? found.value : null));

/** The fields and areas of which the image shows one, where its lines do not tell which. */
export const fieldChoices = computed(() => lastFound.value?.choices ?? []);
/** The areas that the image shows in place of the chosen one, as detected. */
export const detectedAreas = computed(() => lastFound.value?.areas ?? []);
/** The same, else as the points say. */
export const otherAreas = computed(() =>
  detectedAreas.value.length ? detectedAreas.value : (preview.value?.report.areas ?? []),
);

/** Whether lines are detected without being asked. */
export const autoDetect = preference("touchline.detect");

export const toggleAutoDetect = () => {
  autoDetect.value = !autoDetect.value;
};

/** What is being searched for, by question(), and what the document was then. */
let asked = /** @type {{ picture: string, of: Doc, what: string } | null} */ (null);
/** Images, fields (of an unknown one, how many there are), areas and rotations that were searched for.
 * @type {Set<string>} */
const tried = new Set();
const question = () =>
  [
    snapshot.value?.id,
    doc.value.field ?? fields.value.length,
    region.value?.name,
    rotation.value,
  ].join(" ");

/** Look for the lines in the image; clicks that are there stay, what was detected before is replaced.
 * @returns {Promise<boolean>} whether points that are sure stand in the document now */
export async function findLines() {
  const picture = snapshot.value,
    document = doc.value,
    area = region.value;
  if (!picture || finding.value) return false;
  const body = {
    snapshot: picture.id,
    field: document.field ?? AUTOMATIC,
    region: area?.name ?? AUTOMATIC,
    ...(area ? { rotate: rotation.value } : {}),
    model: AUTOMATIC,
    keep: false,
  };
  asked = { picture: picture.id, of: document, what: question() };
  tried.add(asked.what);
  found.value = null;
  let points = 0;
  await work.watch(
    (stop, onProgress) => runJob("/calibrations/auto", body, stop, onProgress),
    (/** @type {FoundLines} */ { observations, verdict, areas, recognised }) => {
      if (isOverruled()) return; // the image, its field or its points are others by now
      const choices = recognised?.choices ?? [],
        place = choices.length === 1 ? placeOf(choices[0]) : {},
        clicked = withoutDetected(picture.id, doc.value.observations),
        fresh = onUnclickedLines(observations, clicked),
        isSure = verdict.level !== "unsure" && verdict.level !== "nothing";
      if (!isSure)
        proposals.value = {
          along: false,
          items: fresh.map(({ feature, points: offered }) => ({
            feature: String(feature),
            points: offered,
          })),
        };
      if (isSure && fresh.length) {
        rememberDetected(picture.id, fresh); // first: what follows the document asks for it
        change({ ...doc.value, ...place, observations: [...clicked, ...fresh] });
        points = fresh.reduce((sum, o) => sum + o.points.length, 0);
      } else if (choices.length === 1) change({ ...doc.value, ...place });
      found.value = {
        of: doc.value,
        verdict,
        points,
        areas,
        choices: choices.length > 1 ? choices : [],
      };
    },
  );
  return points > 0;
}

/** Whether the operator has decided meanwhile what the search is to find out: the field, the area or the rotation; or
 * goes on without it. */
function isOverruled() {
  if (!asked || snapshot.value?.id !== asked.picture) return true;
  const { field: name, region: area, rotate, observations } = asked.of,
    now = doc.value;
  return (
    !isEqual([now.field, now.region, now.rotate], [name, area, rotate]) ||
    (area === null && !isEqual(now.observations, observations))
  );
}

/** Detect by itself, from now on: once an image, field, area and rotation, where nobody has placed a point or is about
 * to. What the operator does in its place ends it. */
export function startDetecting() {
  effect(() => {
    const isWanted =
      snapshot.value !== null &&
      (editing.value || (step.value === "field" && region.value === null)) &&
      fields.value.length > 0 &&
      draft.value.state === "saved" &&
      others.value.length === 0 &&
      doc.value.observations.length === 0 &&
      finding.value === null && // of an image that was left
      autoDetect.value;
    const now = question();
    untracked(() => {
      if (isWanted && !tried.has(now)) void findLines();
    });
  });
  effect(() => {
    void [doc.value, snapshot.value];
    untracked(() => {
      if (!finding.value || !asked || !isOverruled()) return;
      finding.value.stop.abort();
      if (snapshot.value?.id !== asked.picture) tried.delete(asked.what); // looked for again when that is opened again
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
  const observations = withoutDetected(
    snapshot.value?.id,
    values.observations ?? doc.value.observations,
  );
  change({ ...doc.value, ...values, observations });
}

/** A field and an area as the document has them. @param {SeenArea & { field: string }} it */
function placeOf({ field: name, region: area, rotate }) {
  const own = fields.value.find((f) => f.name === name)?.regions[area]?.rotate;
  return { field: name, region: area, rotate: rotate === own ? null : rotate };
}

/** Choose an area that the image shows, and detect in it. @param {SeenArea} area */
export function chooseArea(area) {
  changePlace(placeOf({ ...area, field: field.value?.name ?? "" }));
  if (!autoDetect.value || doc.value.observations.length) void findLines(); // else it begins by itself
}

/** Use one of several fields and areas: detect in it, and save what is sure. @param {FieldChoice} choice */
export async function useChoice(choice) {
  const isFound = batch(() => {
    changePlace(placeOf(choice));
    return findLines(); // before it begins by itself
  });
  if ((await isFound) && step.value === "field") run("save");
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
    enabled: () => snapshot.value !== null,
  },
  {
    id: "find-lines",
    label: t("calibrate.find-lines.action.detect"),
    short: t("calibrate.find-lines.action.detect.short"),
    group: "points",
    run: () => void findLines(),
    enabled: () => snapshot.value !== null && fields.value.length > 0 && finding.value === null,
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
