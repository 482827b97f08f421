// A lens from pictures of a board: the board, the pictures, the job that finds the lens, and its result.
import { batch, computed, effect, signal, untracked } from "@preact/signals";
import { ServerUnreachable, call, online } from "../../core/api.js";
import { change, doc, withModel } from "../../core/document.js";
import { followJob, runJob } from "../../core/jobs.js";
import { longWork } from "../../core/long_work.js";
import { go, route } from "../../core/route.js";
import { model, models, notify } from "../../core/state.js";
import { t } from "../../core/words.js";
import { pictureList } from "../lens_pictures/picture_upload.js";
import { listLenses } from "./lenses.js";

const KEPT = "touchline.board"; // a reload goes on with the same board and pictures

/** @typedef {import("../../core/types").LensRecord} LensRecord */

const before = JSON.parse(localStorage.getItem(KEPT) ?? "{}"); // with `job`: the search that this page asked for
/** What the pictures show, and which lens is looked for. */
export const boardRequest = signal(
  /** @type {import("../../core/types").BoardRequest} */ ({
    kind: "chessboard",
    columns: 9,
    rows: 6,
    square_mm: 30,
    marker_mm: 22,
    dictionary: "DICT_4X4_50",
    legacy: false,
    model: "brown-conrady",
    note: "",
    ...before.wanted,
  }),
);
const list = pictureList(before.pictures ?? [], "board", () => persist());
export const { pictures, ready, add: addPictures } = list;
const work = longWork();
export const { search, refusal } = work;
/** The lens whose report is shown. */
export const foundLens = signal(/** @type {LensRecord | null} */ (null));
/** The lens that the next picture of a field gets. */
export const lensForNextPicture = signal(/** @type {LensRecord | null} */ (null));

/** Whether the report is of just these pictures. */
const isOfThese = computed(
  () =>
    foundLens.value !== null &&
    String(foundLens.value.snapshots) === String(ready.value.map((p) => p.id)),
);

/** Where the operator stands, and the next thing to do. */
export const boardNextStep = computed(() => {
  if (search.value)
    return {
      action: "find-lens",
      label: t("board.next-step.finding"),
      missing: t("common.server-busy"),
      done: false,
      sentence: t("board.next-step.server-looks"),
    };
  if (isOfThese.value)
    return {
      action: "use-lens",
      label: t("board.next-step.use-lens"),
      missing: "",
      done: true,
      sentence: t("board.next-step.found"),
    };
  const missing = list.uploading.value
    ? t("lens-pictures.being-uploaded")
    : ready.value.length
      ? ""
      : t("board.next-step.say-which");
  return {
    action: ready.value.length || list.uploading.value ? "find-lens" : "add-pictures",
    label:
      ready.value.length || list.uploading.value
        ? t("board.find-lens")
        : t("board.action.add-pictures"),
    missing: list.uploading.value ? missing : "",
    done: false,
    sentence: missing || t("board.next-step.pictures", { count: ready.value.length }),
  };
});

/** @param {Partial<import("../../core/types").BoardRequest>} changes */
export function changeBoard(changes) {
  boardRequest.value = { ...boardRequest.value, ...changes };
  persist();
}

/** Whether the page is at pictures of a board. */
export const atBoard = computed(() => route.value.view === "board");

/** Go on with a search that is under way whenever the page comes to the board. */
export function startBoard() {
  effect(() => {
    if (atBoard.value) arrived = untracked(goOn);
  });
}

let arrived = Promise.resolve();
/** Go to the board, and return once what was left there is. */
export function openBoard() {
  go("board");
  return arrived;
}

async function goOn() {
  await listLenses();
  try {
    if (before.job && !search.value) await resumeSearch(before.job);
    else if (before.lens && !foundLens.value && !search.value) await showLens(before.lens);
  } catch (error) {
    if (!(error instanceof ServerUnreachable)) delete before.lens; // it was deleted meanwhile
  }
}

/** This page's own search, though the page was left or the server stopped meanwhile. @param {string} id */
async function resumeSearch(id) {
  const job = await call("GET", `/jobs/${id}`).catch((error) => {
    if (error instanceof ServerUnreachable) throw error;
    return null;
  }); // none: forgotten by now
  if (job) await work.watch((stop, onProgress) => followJob(job, stop, onProgress), show);
  else if (before.lens && !foundLens.value) await showLens(before.lens);
  if (search.value === null && online.value) persist({ job: undefined });
}

/** From a camera that looks at the board. */
export const takeBoardPicture = list.take;
export const removePicture = list.remove;
/**
 * One that was taken live, and where the board was in it.
 * @param {string} id
 * @param {string} camera
 * @param {import("../../core/types").Point[] | null} quad
 */
export const addCapturedView = (id, camera, quad) =>
  list.keep({
    key: id,
    name: t("board.view-name", { number: pictures.value.length + 1 }),
    state: "kept",
    id,
    why: "",
    camera,
    quad,
  });

export function removePictures() {
  foundLens.value = null;
  refusal.value = null;
  list.clear();
}

export function findLens() {
  const {
    model: name,
    note,
    kind,
    columns,
    rows,
    square_mm,
    marker_mm,
    dictionary,
    legacy,
  } = boardRequest.value;
  const board = {
    kind,
    columns,
    rows,
    square_mm,
    ...(kind === "charuco" ? { marker_mm, dictionary, legacy } : {}),
  };
  const body = { snapshots: ready.value.map((p) => p.id), board, model: name, note };
  return work
    .watch(
      (stop, onProgress) =>
        runJob("/calibrations/board", body, stop, (job) => {
          if (before.job !== job.id) persist({ job: job.id });
          onProgress(job);
        }),
      show,
    )
    .finally(() => {
      if (online.value) persist({ job: undefined });
    });
}

/** @param {{ record: LensRecord }} result */
async function show({ record }) {
  foundLens.value = record;
  persist();
  await listLenses();
}

/** @param {string} id */
export async function showLens(id) {
  foundLens.value = await call("GET", `/lenses/${encodeURIComponent(id)}`);
  refusal.value = null;
}

/** The next picture of a field is fitted with this lens. @param {LensRecord} lens */
export function useLens(lens) {
  batch(() => {
    lensForNextPicture.value = lens;
    go("wall");
  });
}

/** Give a picture of a field the lens that was chosen for it. @param {import("../../core/types").Snapshot} picture */
export function applyChosenLens({ width, height }) {
  const lens = lensForNextPicture.value,
    next = models.value.find((m) => m.name === lens?.model);
  lensForNextPicture.value = null;
  if (!lens || !next) return;
  if (lens.image_size[0] !== width || lens.image_size[1] !== height) {
    return notify({
      level: "warn",
      text: t("board.wrong-size", {
        lensWidth: lens.image_size[0],
        lensHeight: lens.image_size[1],
        width,
        height,
      }),
      fix: t("board.wrong-size.fix"),
      about: "picture",
    });
  }
  const chosen = withModel(doc.value, next, model.value);
  change({ ...chosen, options: { ...chosen.options, lens: lens.id, lens_sigma: "own" } });
}

/** What the report says of one picture. @param {import("../../core/types").UploadedPicture} picture */
export function viewReport({ id }) {
  const lens = foundLens.value,
    at = lens?.snapshots?.indexOf(id) ?? -1;
  if (at < 0 || !lens) return null;
  const blank = lens.report.warnings.filter((w) => w.reason === "no-board"), // of the others each is a view, in order
    why = blank.find((w) => w.index === at);
  if (why) return { view: null, why: `${why.text} ${why.fix}` };
  const view = lens.report.views[at - blank.filter((w) => (w.index ?? at) < at).length] ?? null;
  return { view, why: view?.text ?? "" };
}

/** @param {{ job?: string }} [more] */
function persist(more = {}) {
  Object.assign(before, more);
  try {
    localStorage.setItem(
      KEPT,
      JSON.stringify({
        wanted: boardRequest.value,
        pictures: pictures.value.filter((p) => p.state === "kept"),
        lens: foundLens.value?.id,
        job: before.job,
      }),
    );
  } catch {
    /* a full or forbidden store: only a reload is the poorer */
  }
}
