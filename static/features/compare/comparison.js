// What is compared, a still or a live picture: raw against corrected, where each lies, and what is under the pointer.
import { computed, effect, signal, untracked } from "@preact/signals";
import { call } from "../../core/api.js";
import { newestWins } from "../../core/latest_wins.js";
import { atLive, compare, comparing, pointer, snapshot, tellError } from "../../core/state.js";
import { bounds } from "../../canvas/drawing.js";
import { MARGIN_PX, main } from "../../canvas/viewport.js";
import { look } from "../live/camera_page.js";
import { liveMargin, livePointer, liveRecord, liveView, startLiveComparing } from "../live/live_compare.js";
import { version } from "../versions/versions.js";
import { seenIn, startBlinking } from "./blink.js";

/** @typedef {import("../../core/types").Point} Point @typedef {import("../../core/types").Feature} Feature */

const isLive = computed(() => atLive.value !== null);
/** The calibration whose two pictures are in sight. */
export const record = computed(() => (isLive.value ? liveRecord.value : comparing.value ? version.value : null));
/** The stage that they lie on. */
export const sheet = computed(() => (isLive.value ? liveView : main));
/** Corrected pixels shown around the field. */
export const margin = computed(() => (isLive.value ? liveMargin.value : MARGIN_PX));
export const mode = computed(() => (isLive.value ? look.value.view : compare.value.mode));
/** What is seen now: of the ways to compare, blinking is one picture after the other. */
export const seen = computed(() => seenIn(mode.value));
const pointed = computed(() => (isLive.value ? livePointer.value : pointer.value));
/** Which of two panes the pointer is in: 0 the raw one. */
export const paneUnder = signal(0);

/** @typedef {{ of: string, raw: Feature[], corrected: Feature[] }} Lines in pixels of each picture, the corrected one's margin counted */
const fetched = signal(/** @type {Lines | null} */ (null));
const wanted = computed(() => (record.value && (!isLive.value || margin.value) ? { id: record.value.id, margin: margin.value } : null));
/** The field's lines on both pictures. */
export const lines = computed(() => (fetched.value?.of === JSON.stringify(wanted.value) ? fetched.value : null));

/** Where the corrected picture lies, in raw picture pixels, so that its borders cover the raw ones: X = x + scale · U. */
export const laid = computed(() => {
  const it = lines.value;
  if (!it) return null;
  const borders = (/** @type {Feature[]} */ f) => bounds(f.filter((l) => l.kind === "border").flatMap((l) => l.points));
  const raw = borders(it.raw), corrected = borders(it.corrected);
  const scale = Math.sqrt((raw.width * raw.height) / (corrected.width * corrected.height));
  return { scale, x: raw.x - scale * corrected.x, y: raw.y - scale * corrected.y };
});

/** What the pointer is over, in the words of POST transform. */
export const asked = computed(() => {
  const at = pointed.value, id = record.value?.id, here = laid.value;
  if (!at || !id || !here) return null;
  const { k, tx } = sheet.value.view.value;
  const isRaw = seen.value === "raw" || (seen.value === "wipe" && (at.x + 0.5) * k + tx < compare.value.at * sheet.value.size.value.width)
    || (seen.value === "side" && paneUnder.value === 0);
  if (isRaw) return { id, from: "image", point: /** @type {Point} */ ([at.x, at.y]) };
  return { id, from: "corrected", point: /** @type {Point} */ ([(at.x - here.x) / here.scale - margin.value, (at.y - here.y) / here.scale - margin.value]) };
});

/** Field millimetres under the pointer. */
export const underPointer = signal(/** @type {Point | null} */ (null));
/** The same place in the other picture, side by side: its pixel there. */
export const counterpart = signal(/** @type {{ on: "image" | "corrected", point: Point } | null} */ (null));

const askPosition = newestWins(async (/** @type {NonNullable<typeof asked.value>} */ { id, from, point }) => {
  const on = from === "image" ? "corrected" : "image", isSide = seen.peek() === "side";
  const get = async (/** @type {string} */ to) => (await call("POST", `/calibrations/${id}/transform`, { from, to, points: [point] })).points[0];
  try {
    const [place, other] = await Promise.all([get("field"), isSide ? get(on) : null]);
    underPointer.value = place;
    counterpart.value = other && { on, point: other };
  } catch { underPointer.value = counterpart.value = null; }
});

/** Fetch lines and positions for what is compared, from now on. */
export function startComparing() {
  startLiveComparing();
  startBlinking(() => record.value !== null && mode.value === "blink");
  effect(() => {
    const now = wanted.value;
    if (!now || fetched.peek()?.of === JSON.stringify(now)) return;
    const get = async (/** @type {string} */ frame) => (await call("GET", `/calibrations/${now.id}/overlay.json?frame=${frame}&margin_px=${now.margin}`)).features;
    Promise.all([get("raw"), get("corrected")]).then(([raw, corrected]) => { fetched.value = { of: JSON.stringify(now), raw, corrected }; }, tellError);
  });
  effect(() => {
    const question = asked.value;
    untracked(() => { if (question) void askPosition(question); else underPointer.value = counterpart.value = null; });
  });
  effect(() => { // a stage that is higher than wide has them one above the other
    const isSide = record.value !== null && mode.value === "side", { width, height } = sheet.value.size.value;
    const picture = record.value ? { width: record.value.image_size[0], height: record.value.image_size[1] } : snapshot.value;
    const panes = !isSide ? { columns: 1, rows: 1 } : height > 1.1 * width ? { columns: 1, rows: 2 } : { columns: 2, rows: 1 };
    untracked(() => sheet.value.divide(panes, picture));
  });
}
