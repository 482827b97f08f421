// The field as it is: adjusted on the server to tape distances or to what a calibration found, and lines of a picture.
import { effect, signal, untracked } from "@preact/signals";
import { call } from "../../core/api.js";
import { docOf, paintedMarks, sentOf } from "./document.js";
import { chosen, edit, history, opened, refusal } from "./editor.js";
import { refuse } from "./saving.js";

/**
 * @typedef {{ from: string, to: string, mm: number | null }} Distance
 * @typedef {{ offsets?: Record<string, { mm: number, sigma_mm: number | null }>, residuals_mm?: number[],
 *   added?: string[] }} Found offsets: of lines that were moved; added: lines and circles that a picture shows
 */

/** What was measured by tape on the field that is open. */
export const distances = signal(/** @type {Distance[]} */ ([]));
/** What the last adjustment has found; null before one. */
export const found = signal(/** @type {Found | null} */ (null));
export const measuring = signal(false);

const KEPT = "touchline.tape.";

/** @param {Distance[]} next */
export function setDistances(next) {
  distances.value = next;
  if (opened.value) localStorage.setItem(KEPT + opened.value.key, JSON.stringify(next));
}

/** Those that are complete. */
const complete = () => distances.value.filter((d) => d.from && d.to && d.mm);

// What was typed belongs to the field that it was typed for, and outlives a reload.
let shown = "";
effect(() => {
  const key = opened.value?.key ?? "";
  untracked(() => {
    if (key === shown) return;
    const moved = shown.startsWith("+") && key.startsWith("="); // a new one was saved: it is the same field
    if (moved) localStorage.removeItem(KEPT + shown);
    shown = key;
    if (moved) return setDistances(distances.value);
    found.value = null;
    try {
      distances.value = JSON.parse(localStorage.getItem(KEPT + key) ?? "[]");
    } catch {
      distances.value = [];
    }
  });
});

/** @param {string} path @param {Record<string, unknown>} body */
async function adjust(path, body) {
  const doc = history.doc.value;
  if (!doc || measuring.value) return;
  measuring.value = true;
  refusal.value = null;
  try {
    const answer = await call("POST", path, {
      ...body,
      field: { ...sentOf(doc), name: doc.name || "new" },
    });
    if (history.doc.value !== doc) return; // it was changed meanwhile
    const { name, title } = doc,
      moved = docOf(answer.field);
    edit(() => ({
      ...moved,
      name,
      title,
      lines: [...moved.lines, ...doc.lines.filter((l) => l.off)],
      arcs: [...moved.arcs, ...doc.arcs.filter((a) => a.off)],
    }));
    found.value = answer;
    if (answer.added)
      chosen.value = paintedMarks(moved).filter((mark) => answer.added.includes(mark.name));
  } catch (error) {
    refuse(error);
  } finally {
    measuring.value = false;
  }
}

export const adjustToTape = () => adjust("/fields/measured", { distances: complete() });
/** @param {string} calibration */
export const adoptOffsets = (calibration) => adjust("/fields/painted", { calibration });
/** @param {string} calibration */
export const addSeen = (calibration) => adjust("/fields/seen", { calibration });
export const canAdjust = () => complete().length > 0 && !measuring.value;
