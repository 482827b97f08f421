// Straight edges: how straight a camera's pictures show them, the job that judges them, and its result.
import { computed, effect, signal, untracked } from "@preact/signals";
import { ServerUnreachable, call, request } from "../../core/api.js";
import { followJob, runJob } from "../../core/jobs.js";
import { longWork } from "../../core/long_work.js";
import { route } from "../../core/route.js";
import { notifyError } from "../../core/state.js";
import { t } from "../../core/words.js";
import { pictureList } from "../lens_pictures/picture_upload.js";

const KEPT = "touchline.straight"; // a reload goes on with the same pictures
const WIDEST_PX = 1600; // of a straightened picture: it is looked at, not measured in

/** @typedef {import("../../core/types").Straightness} Straightness @typedef {import("../../core/types").Edge} Edge */

const before = JSON.parse(localStorage.getItem(KEPT) ?? "{}");
/** The lens that is looked for. */
export const kind = signal(/** @type {string} */ (before.kind ?? "auto"));
const list = pictureList(before.pictures ?? [], "straight", () => keep());
export const {
  pictures,
  ready,
  add: addEdgePictures,
  take: takeEdgePicture,
  remove: removePicture,
} = list;
const work = longWork();
export const { search, refusal } = work;
/** What was found, from which pictures, by which job: the server keeps the report as long as the job. */
export const straightnessResult = signal(
  /** @type {{ report: Straightness, ids: string[], kind: string, job: string } | null} */ (null),
);
/** Which of the pictures is looked at, and how. */
export const shownPicture = signal(
  /** @type {{ id: string, straight: boolean }} */ ({ id: "", straight: false }),
);
/** The edge that is pointed at, by its name. */
export const pointed = signal("");
/** The straightened picture, once it is there. */
export const straightened = signal(/** @type {{ of: string, url: string } | null} */ (null));

/** Whether the report is of just these pictures and this kind of lens. */
export const isResultCurrent = computed(
  () =>
    straightnessResult.value !== null &&
    straightnessResult.value.kind === kind.value &&
    String(straightnessResult.value.ids) === String(ready.value.map((p) => p.id)),
);
export const viewedPicture = computed(
  () => ready.value.find((p) => p.id === shownPicture.value.id) ?? ready.value[0] ?? null,
);
/** The edges of the picture that is looked at. */
export const edges = computed(() => {
  const at =
    isResultCurrent.value && viewedPicture.value
      ? straightnessResult.value?.ids.indexOf(viewedPicture.value.id)
      : -1;
  return straightnessResult.value && at !== -1
    ? straightnessResult.value.report.lines.filter((line) => line.picture === at)
    : [];
});

/** Where the operator stands, and the next thing to do. */
export const straightNextStep = computed(() => {
  const has = ready.value.length > 0 || list.uploading.value;
  if (search.value)
    return {
      action: "judge-edges",
      label: t("straight.next-step.judging"),
      missing: t("common.server-busy"),
      done: false,
      sentence: t("straight.next-step.server-looks"),
    };
  if (isResultCurrent.value)
    return {
      action: "straighten",
      label: shownPicture.value.straight
        ? t("straight.next-step.show-taken")
        : t("straight.next-step.show-straightened"),
      missing: "",
      done: true,
      sentence: t("straight.next-step.judged"),
    };
  if (!has)
    return {
      action: "add-edges",
      label: t("straight.add-pictures"),
      missing: "",
      done: false,
      sentence: t("straight.next-step.add"),
    };
  return {
    action: "judge-edges",
    label: t("straight.judge-edges"),
    missing: list.uploading.value ? t("lens-pictures.being-uploaded") : "",
    done: false,
    sentence: list.uploading.value
      ? t("lens-pictures.being-uploaded")
      : t("straight.next-step.pictures", { count: ready.value.length }),
  };
});

/** @param {string} name */
export function chooseKind(name) {
  kind.value = name;
  keep();
}

/** Whether the page is at straight edges. */
export const atStraight = computed(() => route.value.view === "edges");

/** Go on with what was judged or is being judged whenever the page comes to the desk. */
export function startStraight() {
  effect(() => {
    if (atStraight.value) untracked(() => void goOn());
  });
}

async function goOn() {
  if (!before.job || straightnessResult.value || search.value) return;
  try {
    const job = await call("GET", `/jobs/${encodeURIComponent(before.job)}`);
    if (job.state === "done") show(job.result, before.ids, before.judged, job.id);
    else if (job.state === "queued" || job.state === "running")
      await work.watch(
        (stop, onProgress) => followJob(job, stop, onProgress),
        (report) => show(report, before.ids, before.judged, job.id),
      );
  } catch (error) {
    if (!(error instanceof ServerUnreachable)) delete before.job; // the server was stopped meanwhile
  }
}

export function removePictures() {
  straightnessResult.value = null;
  refusal.value = null;
  list.clear();
}

export function judgeEdges() {
  const ids = ready.value.map((p) => p.id),
    lens = kind.value;
  const body = { snapshots: ids, lens };
  let job = "";
  return work.watch(
    (stop, onProgress) =>
      runJob("/straightness?job=true", body, stop, (now) => {
        if (!job) keep({ job: (job = now.id), ids, judged: lens });
        onProgress(now);
      }),
    (report) => show(report, ids, lens, job),
  );
}

/** @param {Straightness} report @param {string[]} ids @param {string} lens @param {string} job */
function show(report, ids, lens, job) {
  straightnessResult.value = { report, ids, kind: lens, job };
  shownPicture.value = { ...shownPicture.value, straight: false };
  forgetStraightened();
  keep({ job, ids, judged: lens });
}

/** Look at another of the pictures. @param {string} id */
export function viewPicture(id) {
  shownPicture.value = { ...shownPicture.value, id };
  pointed.value = "";
  void straighten();
}

/** Show the picture as it was taken, or without its bend. @param {boolean} straight */
export function showStraight(straight) {
  shownPicture.value = { ...shownPicture.value, straight };
  void straighten();
}

/** Fetch the straightened picture that is to be seen. */
async function straighten() {
  const picture = viewedPicture.value,
    lens = straightnessResult.value?.report.lens;
  if (!shownPicture.value.straight || !picture || !lens || straightened.value?.of === picture.id)
    return;
  try {
    const answer = await request(
      "POST",
      `/straightness/picture.jpg?width=${Math.min(WIDEST_PX, lens.image_size[0])}`,
      { json: { snapshot: picture.id, lens } },
    );
    const url = URL.createObjectURL(await answer.blob());
    forgetStraightened();
    if (viewedPicture.value?.id === picture.id && straightnessResult.value?.report.lens === lens)
      straightened.value = { of: picture.id, url };
    else URL.revokeObjectURL(url);
  } catch (error) {
    notifyError(error);
  }
}

function forgetStraightened() {
  if (straightened.value) URL.revokeObjectURL(straightened.value.url);
  straightened.value = null;
}

/** @param {{ job?: string, ids?: string[], judged?: string }} [more] */
function keep(more = {}) {
  Object.assign(before, more);
  const { job, ids, judged: by } = before;
  try {
    localStorage.setItem(
      KEPT,
      JSON.stringify({
        kind: kind.value,
        pictures: pictures.value.filter((p) => p.state === "kept"),
        job,
        ids,
        judged: by,
      }),
    );
  } catch {
    /* a full or forbidden store: only a reload is the poorer */
  }
}
