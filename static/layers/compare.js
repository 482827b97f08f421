// Raw and corrected in one place: the corrected picture is laid so that its borders cover the raw ones, and a wipe parts them.
import { computed, effect, signal, untracked } from "@preact/signals";
import { address, call } from "../api.js";
import { newestWins } from "../newest.js";
import { html } from "../html.js";
import { compare, comparing, pointer, showLines, snapshot, tellError } from "../state.js";
import { version } from "../versions.js";
import { MARGIN_PX, stageSize, view } from "../view.js";
import { bounds, placed } from "./drawing.js";
import { ResidualArrows } from "./arrows.js";
import { Heat } from "./heat.js";
import { FieldLines } from "./overlay.js";

const STEP = 0.02;

/** @typedef {{ id: string, raw: import("../types").Feature[], corrected: import("../types").Feature[] }} Lines */
const lines = signal(/** @type {Lines | null} */ (null));
/** Field millimetres under the pointer. */
export const underPointer = signal(/** @type {import("../types").Point | null} */ (null));

/** Where the corrected picture lies, in raw picture pixels: X = x + scale · U. */
export const laid = computed(() => {
  const it = lines.value;
  if (!it || it.id !== version.value?.id) return null;
  const borders = (/** @type {import("../types").Feature[]} */ f) => bounds(f.filter((l) => l.kind === "border").flatMap((l) => l.points));
  const raw = borders(it.raw), corrected = borders(it.corrected);
  const scale = Math.sqrt((raw.width * raw.height) / (corrected.width * corrected.height));
  return { scale, x: raw.x - scale * corrected.x, y: raw.y - scale * corrected.y };
});

/** What the pointer is over, in the words of POST transform. */
export const asked = computed(() => {
  const at = pointer.value, id = version.value?.id, here = laid.value;
  if (!at || !id || !here || !comparing.value) return null;
  const { mode, at: share } = compare.value, { k, tx } = view.value;
  const isRaw = mode === "raw" || (mode === "wipe" && (at.x + 0.5) * k + tx < share * stageSize.value.width);
  if (isRaw) return { id, from: "image", point: [at.x, at.y] };
  return { id, from: "corrected", point: [(at.x - here.x) / here.scale - MARGIN_PX, (at.y - here.y) / here.scale - MARGIN_PX] };
});

const askPosition = newestWins(async (/** @type {NonNullable<typeof asked.value>} */ { id, from, point }) => {
  try {
    underPointer.value = (await call("POST", `/calibrations/${id}/transform`, { from, to: "field", points: [point] })).points[0];
  } catch { underPointer.value = null; }
});

/** Fetch lines and positions for the version that is compared, from now on. */
export function startComparing() {
  effect(() => {
    const id = version.value?.id;
    if (!comparing.value || !id || lines.peek()?.id === id) return;
    const get = async (/** @type {string} */ frame) => (await call("GET", `/calibrations/${id}/overlay.json?frame=${frame}&margin_px=${MARGIN_PX}`)).features;
    Promise.all([get("raw"), get("corrected")]).then(([raw, corrected]) => { lines.value = { id, raw, corrected }; }, tellError);
  });
  effect(() => {
    const question = asked.value;
    untracked(() => { if (question) void askPosition(question); else underPointer.value = null; });
  });
}

/** The corrected picture's address. @param {string} id @param {string} suffix */
export const correctedAddress = (id, suffix) => address(`/calibrations/${id}/corrected.${suffix}?margin_px=${MARGIN_PX}`);

export function Corrected() {
  const here = laid.value, it = version.value, { k, tx, ty } = view.value, { mode, at } = compare.value;
  if (!here || !it || mode === "raw") return null;
  // Half a pixel: an <img> begins at its first pixel's edge, positions at its centre.
  const x = (here.x - 0.5 * here.scale + 0.5) * k + tx, y = (here.y - 0.5 * here.scale + 0.5) * k + ty;
  const size = it.corrected_size.map((side) => side + 2 * MARGIN_PX);
  const clip = mode === "wipe" ? `clip-path:inset(0 0 0 ${at * 100}%)` : "";
  return html`<div class="half" style=${clip}>
    <img class="picture" data-testid="corrected" alt="The corrected picture" draggable=${false} src=${correctedAddress(it.id, "jpg")}
      style=${`transform:translate(${x}px,${y}px) scale(${k * here.scale})`}/>
    <${Heat} frame="corrected" size=${size} margin=${MARGIN_PX} x=${x} y=${y} k=${k * here.scale}/>
    <${ResidualArrows} frame="corrected" x=${x} y=${y} k=${k * here.scale}/>
    ${showLines.value && html`<svg class="overlay" aria-hidden="true"><${FieldLines} name="on-corrected" features=${lines.value?.corrected ?? []}
      size=${size} transform=${placed(x, y, k * here.scale)}/></svg>`}
  </div>`;
}

/** The field's lines on the raw side. */
export function RawLines() {
  const picture = snapshot.value;
  if (!showLines.value || !picture || !lines.value || lines.value.id !== version.value?.id) return null;
  const { k, tx, ty } = view.value;
  return html`<svg class="overlay" aria-hidden="true"><${FieldLines} name="on-raw" size=${[picture.width, picture.height]} features=${lines.value.raw} transform=${placed(tx, ty, k)}/></svg>`;
}

/** The style that leaves the raw half. */
export const rawClip = computed(() => {
  if (!comparing.value || !laid.value) return "";
  const { mode, at } = compare.value;
  return mode === "corrected" ? "visibility:hidden" : mode === "wipe" ? `clip-path:inset(0 ${(1 - at) * 100}% 0 0)` : "";
});

export function Wipe() {
  if (compare.value.mode !== "wipe" || !laid.value) return null;
  const { at } = compare.value;
  /** @param {number} share */
  const moveTo = (share) => { compare.value = { ...compare.value, at: Math.min(0.98, Math.max(0.02, share)) }; };
  /** @param {PointerEvent} e */
  const down = (e) => /** @type {Element} */ (e.currentTarget).setPointerCapture(e.pointerId);
  /** @param {PointerEvent} e */
  const move = (e) => {
    const handle = /** @type {HTMLElement} */ (e.currentTarget), stage = /** @type {HTMLElement} */ (handle.parentElement).getBoundingClientRect();
    if (handle.hasPointerCapture(e.pointerId)) moveTo((e.clientX - stage.left) / stage.width);
  };
  /** @param {KeyboardEvent} e */
  const key = (e) => {
    const towards = { ArrowLeft: at - STEP, ArrowRight: at + STEP, Home: 0, End: 1 }[e.key];
    if (towards === undefined) return;
    e.preventDefault();
    moveTo(towards);
  };
  return html`<div class="wipe" data-off-stage data-testid="wipe" role="slider" tabindex="0" aria-label="Wipe between raw and corrected"
      aria-valuemin="0" aria-valuemax="100" aria-valuenow=${Math.round(at * 100)} aria-valuetext=${`${Math.round(at * 100)} % raw`}
      style=${`left:${at * 100}%`} onPointerDown=${down} onPointerMove=${move} onKeyDown=${key}>
    <span class="side raw">Raw</span><span class="grip" aria-hidden="true"></span><span class="side corrected">Corrected</span>
  </div>`;
}
