// The comparison of raw and corrected, of a still or a live picture: where each picture lies, and what is under the
// pointer.
import { computed, effect, signal, untracked } from "@preact/signals";
import { call } from "../../core/api.js";
import { latestWins } from "../../core/latest_wins.js";
import { dragging } from "../../core/document.js";
import { compare, comparing, editing, notifyError, pointer, snapshot } from "../../core/state.js";
import { bounds } from "../../canvas/drawing.js";
import { correctsHere, isTooLarge } from "../../canvas/graphics.js";
import { MARGIN_PX, mainViewport } from "../../canvas/viewport.js";
import { preview, wantsMesh } from "../calibrate/fitting.js";
import { atLive, cameraView } from "../live/camera_page.js";
import {
  liveMargin,
  livePointer,
  liveRecord,
  liveView,
  startLiveComparing,
} from "../live/live_compare.js";
import { version } from "../versions/versions.js";
import { pictureShownIn, startBlinking } from "./blink.js";
import { mesh, startCorrection } from "./correction.js";

/** @typedef {import("../../core/types").Point} Point @typedef {import("../../core/types").Feature} Feature */

/** The calibration whose two pictures are in sight. */
export const comparedVersion = computed(() =>
  atLive.value ? liveRecord.value : comparing.value ? version.value : null,
);
/** The picture that is corrected with it, or with the clicks as they are now: both its sizes. */
export const compared = computed(() =>
  editing.value
    ? mesh.value && wantsMesh.value
      ? { image_size: mesh.value.image_size, corrected_size: mesh.value.corrected_size }
      : null
    : comparedVersion.value,
);
/** The stage that they lie on. */
export const activeViewport = computed(() => (atLive.value ? liveView : mainViewport));
/** Corrected pixels shown around the field. */
export const margin = computed(() => (atLive.value ? liveMargin.value : MARGIN_PX));
export const mode = computed(() =>
  atLive.value ? cameraView.value.view : editing.value ? compare.value.editing : compare.value.mode,
);
/** What is seen now: of the ways to compare, blinking is one picture after the other. */
export const visiblePicture = computed(() =>
  editing.value && !(compared.value && correctsHere.value) ? "raw" : pictureShownIn(mode.value),
);
const pointed = computed(() => (atLive.value ? livePointer.value : pointer.value));
/** Which of two panes the pointer is in: 0 the raw one. */
export const paneUnder = signal(0);

/**
 * @typedef {{ of: string, raw: Feature[], corrected: Feature[] }} Lines in pixels of each picture, the corrected one's
 * margin counted
 */
const fetched = signal(/** @type {Lines | null} */ (null));
const wanted = computed(() =>
  comparedVersion.value && (!atLive.value || margin.value)
    ? { id: comparedVersion.value.id, margin: margin.value }
    : null,
);
/** Of the clicks, as they were when no point was last held: the corrected picture stays in its place meanwhile. */
const settled = signal(/** @type {import("../../core/types").Preview | null} */ (null));
/** @param {import("../../core/types").Preview | null} it */
const linesOf = (it) => (it?.mesh ? { raw: it.overlay, corrected: it.mesh.overlay } : null);
/** The field's lines on both pictures. */
export const lines = computed(() =>
  editing.value
    ? linesOf(preview.value)
    : fetched.value?.of === JSON.stringify(wanted.value)
      ? fetched.value
      : null,
);

/**
 * Where the corrected picture lies, in raw picture pixels, so that its borders cover the raw ones: X = x + scale · U.
 */
export const correctedPlacement = computed(() => {
  const it = editing.value ? linesOf(settled.value) : lines.value;
  if (!it) return null;
  const borders = (/** @type {Feature[]} */ f) =>
    bounds(f.filter((l) => l.kind === "border").flatMap((l) => l.points));
  const raw = borders(it.raw),
    corrected = borders(it.corrected);
  const scale = Math.sqrt((raw.width * raw.height) / (corrected.width * corrected.height));
  return { scale, x: raw.x - scale * corrected.x, y: raw.y - scale * corrected.y };
});

/** What the pointer is over, in the words of POST transform. */
export const pointedAt = computed(() => {
  const at = pointed.value,
    id = comparedVersion.value?.id,
    here = correctedPlacement.value;
  if (!at || !id || !here) return null;
  const { k, tx } = activeViewport.value.view.value;
  const isRaw =
    visiblePicture.value === "raw" ||
    (visiblePicture.value === "wipe" &&
      (at.x + 0.5) * k + tx < compare.value.at * activeViewport.value.size.value.width) ||
    (visiblePicture.value === "side" && paneUnder.value === 0);
  if (isRaw) return { id, from: "image", point: /** @type {Point} */ ([at.x, at.y]) };
  return {
    id,
    from: "corrected",
    point: /** @type {Point} */ ([
      (at.x - here.x) / here.scale - margin.value,
      (at.y - here.y) / here.scale - margin.value,
    ]),
  };
});

/** Whether a place of the stage shows the corrected picture. @param {number} sx @param {number} sy stage pixels */
export function isOverCorrected(sx, sy) {
  if (!compared.value || !correctedPlacement.value) return false;
  const { size, paneAt } = activeViewport.value;
  switch (visiblePicture.value) {
    case "wipe":
      return sx >= compare.value.at * size.value.width;
    case "side":
      return paneAt(sx, sy) === 1;
    default:
      return visiblePicture.value === "corrected";
  }
}

/** Field millimetres under the pointer. */
export const fieldUnderPointer = signal(/** @type {Point | null} */ (null));
/** The same place in the other picture, side by side: its pixel there. */
export const counterpart = signal(
  /** @type {{ on: "image" | "corrected", point: Point } | null} */ (null),
);

const askPosition = latestWins(
  async (/** @type {NonNullable<typeof pointedAt.value>} */ { id, from, point }) => {
    const on = from === "image" ? "corrected" : "image",
      isSide = visiblePicture.peek() === "side";
    const get = async (/** @type {string} */ to) =>
      (await call("POST", `/calibrations/${id}/transform`, { from, to, points: [point] }))
        .points[0];
    try {
      const [place, other] = await Promise.all([get("field"), isSide ? get(on) : null]);
      fieldUnderPointer.value = place;
      counterpart.value = other && { on, point: other };
    } catch {
      fieldUnderPointer.value = counterpart.value = null;
    }
  },
);

/** Fetch lines and positions for what is compared, from now on. */
export function startComparing() {
  startLiveComparing();
  startCorrection();
  startBlinking(() => compared.value !== null && mode.value === "blink");
  effect(() => {
    const it = preview.value;
    if (!dragging.value) settled.value = it;
  });
  effect(() => {
    // points are clicked in the raw picture: another one begins with it
    if (!snapshot.value?.id) return;
    compare.value = { ...untracked(() => compare.value), editing: "raw" };
    isTooLarge.value = false;
  });
  effect(() => {
    const now = wanted.value;
    if (!now || fetched.peek()?.of === JSON.stringify(now)) return;
    const get = async (/** @type {string} */ frame) =>
      (
        await call(
          "GET",
          `/calibrations/${now.id}/overlay.json?frame=${frame}&margin_px=${now.margin}`,
        )
      ).features;
    Promise.all([get("raw"), get("corrected")]).then(([raw, corrected]) => {
      fetched.value = { of: JSON.stringify(now), raw, corrected };
    }, notifyError);
  });
  effect(() => {
    const question = pointedAt.value;
    untracked(() => {
      if (question) void askPosition(question);
      else fieldUnderPointer.value = counterpart.value = null;
    });
  });
  effect(() => {
    // a stage that is higher than wide has them one above the other
    const isSide = compared.value !== null && mode.value === "side",
      { width, height } = activeViewport.value.size.value;
    const picture = compared.value
      ? { width: compared.value.image_size[0], height: compared.value.image_size[1] }
      : snapshot.value;
    const panes = !isSide
      ? { columns: 1, rows: 1 }
      : height > 1.1 * width
        ? { columns: 1, rows: 2 }
        : { columns: 2, rows: 1 };
    untracked(() => activeViewport.value.divide(panes, picture));
  });
}
