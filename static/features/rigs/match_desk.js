// The desk of matched points: two cameras of a rig, an image from each, and what is matched in both.
import { batch, computed, effect, signal, untracked } from "@preact/signals";
import { call, request } from "../../core/api.js";
import { createHistory, isEqual } from "../../core/history.js";
import { Stopped } from "../../core/jobs.js";
import { requestOrder } from "../../core/latest_wins.js";
import { goInstead, route } from "../../core/route.js";
import { fields, notify, snapshots } from "../../core/state.js";
import { t } from "../../core/words.js";
import { createViewport } from "../../canvas/viewport.js";
import { EMPTY, isComplete, isOf, keep, kept, keyOf, sentOf } from "./kept_matches.js";
import { found, rig, rigCheck, search, step, stopStep, watch } from "./rig.js";

/**
 * @typedef {import("./types").Side} Side
 * @typedef {import("./types").Match} Match
 * @typedef {import("../../core/types").Snapshot} Snapshot
 */

/** @type {Side[]} */
export const SIDES = ["a", "b"];
const HAT_MM = 150; // of a field that does not say so: the largest league

export const desk = createHistory(EMPTY);
export const pictures = signal(/** @type {Record<Side, Snapshot | null>} */ ({ a: null, b: null }));
export const views = { a: createViewport(), b: createViewport() };
/** Where the keys work. */
export const side = signal(/** @type {Side} */ ("a"));
export const chosen = signal(/** @type {{ side: Side, index: number } | null} */ (null));
export const pointed = signal(
  /** @type {{ side: Side, x: number, y: number, touch: boolean, down: boolean } | null} */ (null),
);
/** How high the next points lie, mm; null: not known. */
export const nextHeight = signal(/** @type {number | null} */ (0));

/** Whether the page is at the desk. */
export const atDesk = computed(() => route.value.view === "match");
export const both = computed(() => pictures.value.a !== null && pictures.value.b !== null);
export const complete = computed(() => desk.doc.value.matches.filter(isComplete).length);

/** The two cameras that the address names, as the rig has them; null where it has no such two. */
export const members = computed(() => {
  const { left, right } = route.value,
    [a, b] =
      (atDesk.value && rig.value?.cameras.filter((c) => c.camera === left || c.camera === right)) ||
      [];
  return a && b ? { a, b } : null;
});
const key = computed(() =>
  rig.value && members.value
    ? keyOf(rig.value.name, members.value.a.camera, members.value.b.camera)
    : "",
);
/** Under which key the document is kept. */
const opened = signal("");

/** How high robot tops are over the rig's field, mm. */
export const hatMm = computed(
  () => fields.value.find((f) => f.name === rig.value?.field)?.hat_height_mm ?? HAT_MM,
);

/** What the check says of the two. */
export const checked = computed(
  () =>
    found.value?.pairs.find(
      (p) => p.a === members.value?.a.camera && p.b === members.value?.b.camera,
    ) ?? null,
);
/** With what matches they were checked; null where there were none. */
export const sent = computed(
  () =>
    rigCheck.value?.matches.find((m) => m.a === checked.value?.a && m.b === checked.value.b) ??
    null,
);
/** Whether they were checked with other matches than those of now. */
export const isChanged = computed(() => {
  const it = checked.value;
  return it !== null && !isEqual(sentOf(it.a, it.b, desk.doc.value.matches), sent.value);
});

/** @param {Side} s @returns {Side} */
export const other = (s) => (s === "a" ? "b" : "a");

/** What the next click makes: the second point of a match that waits for it, else a new match. */
export const wanted = computed(() => {
  const { matches } = desk.doc.value,
    waits = (/** @type {Match | undefined} */ m) => m !== undefined && !isComplete(m),
    index =
      chosen.value && waits(matches[chosen.value.index])
        ? chosen.value.index
        : matches.findIndex(waits);
  return index < 0
    ? { index: matches.length, side: /** @type {Side} */ ("a"), isNew: true }
    : { index, side: /** @type {Side} */ (matches[index].a ? "b" : "a"), isNew: false };
});

/** Where the operator stands, and the next thing to do. */
export const matchNextStep = computed(() => {
  const it = members.value;
  if (!it) return step("step-camera", t("rig.step.back"), t("rig.match.no-such"));
  if (search.value) return stopStep();
  if (!both.value) return step("take-match-images", t("rig.match.take"), t("rig.match.step.take"));
  const verdict = checked.value?.verdict,
    isCurrent = Boolean(verdict) && !isChanged.value;
  return step(
    "check-rig",
    verdict ? t("rig.step.check-again") : t("rig.check"),
    sentence(it, isCurrent),
    {
      done: isCurrent && verdict?.level === "good",
    },
  );
});

/** @param {NonNullable<typeof members.value>} cameras @param {boolean} isCurrent whether these matches were checked */
function sentence(cameras, isCurrent) {
  const without = SIDES.find((s) => !cameras[s].calibration),
    { isNew, side: lacking, index } = wanted.value;
  if (without) return t("rig.match.step.uncalibrated", { camera: cameras[without].title });
  if (!isNew) return t(`rig.match.step.click.${lacking}`, { point: index + 1 });
  if (isCurrent) return t("rig.match.step.checked");
  return complete.value
    ? t("rig.match.step.check", { count: complete.value })
    : t("rig.match.step.first");
}

/** An image from each of the two; matches of those before come back with undo. */
export async function takePictures() {
  const at = key.value,
    it = members.value;
  if (!it || search.value) return;
  const take = (/** @type {Side} */ s, /** @type {AbortSignal} */ stop) =>
    request("POST", "/snapshots", { json: { camera: it[s].camera }, stop }).then((answer) =>
      answer.json(),
    );
  await watch(
    (stop) =>
      Promise.all(SIDES.map((s) => take(s, stop))).catch((error) => {
        throw stop.aborted ? new Stopped() : error;
      }),
    (/** @type {Snapshot[]} */ [a, b]) => {
      snapshots.value = [a, b, ...snapshots.value];
      const next = { pictures: { a: a.id, b: b.id }, matches: [] };
      if (opened.value === at) (desk.doc.value.pictures ? desk.change : desk.load)(next);
    },
  );
}

const wishes = requestOrder();

/** Show the images of the document. @param {import("./types").MatchDoc["pictures"]} ids */
async function showPictures(ids) {
  const isNewest = wishes.begin();
  const read = (/** @type {string} */ id) =>
    snapshots.value.find((p) => p.id === id) ?? call("GET", `/snapshots/${id}`).catch(() => null);
  const next = await Promise.all(SIDES.map((s) => ids && read(ids[s])));
  if (!isNewest()) return;
  if (ids && !(next[0] && next[1]))
    notify({
      level: "warn",
      text: t("rig.match.gone"),
      fix: t("rig.match.gone.fix"),
      about: "pictures",
    });
  pictures.value = { a: next[0], b: next[1] };
  for (const s of SIDES) views[s].fit(pictures.value[s]);
}

/** Follow the address, and another tab at the same desk; keep every change in this browser. */
export function startMatches() {
  effect(() => {
    const at = key.value;
    untracked(() => {
      if (!at || !members.value) return;
      const { a, b } = members.value;
      if (a.camera !== route.value.left)
        goInstead("match", { rig: route.value.rig, left: a.camera, right: b.camera });
      if (at === opened.value) {
        desk.change(kept(at)); // a former address may have brought others
        return;
      }
      batch(() => {
        opened.value = at;
        pictures.value = { a: null, b: null };
        chosen.value = null;
        desk.load(kept(at));
      });
      if (!desk.doc.value.pictures) void takePictures();
    });
  });
  const ids = computed(() => JSON.stringify([opened.value, desk.doc.value.pictures]));
  effect(() => {
    if (JSON.parse(ids.value)[0]) untracked(() => void showPictures(desk.doc.value.pictures));
  });
  effect(() => {
    const { doc, dragging } = desk;
    if (opened.value && !dragging.value) keep(opened.value, doc.value);
  });
  addEventListener("storage", (event) => {
    if (opened.value && isOf(event.key, opened.value) && !desk.dragging.value)
      desk.change(kept(opened.value));
  });
}
