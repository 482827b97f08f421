// The server's own warnings: a disk that is nearly full, damaged files; shown above the picture.
import { effect } from "@preact/signals";
import { call, online } from "../../core/api.js";
import { notify } from "../../core/state.js";

const EVERY_MS = 60_000;

/** Look now, whenever the server is back, and every minute. */
export function startHealth() {
  effect(() => {
    if (online.value) look();
  });
  setInterval(() => {
    if (online.value && !document.hidden) look();
  }, EVERY_MS);
}

/** Messages that were shown: one that somebody dismissed does not come again. @type {Set<string>} */
const shownTexts = new Set();

async function look() {
  /**
   * @type {{ warnings: { text: string, fix: string }[], damaged: { kind: string, file: string, note: string | null }[]
   * }}
   */
  let health;
  try {
    health = await call("GET", "/health");
  } catch {
    return;
  } // a silent server is told elsewhere
  for (const { text, fix } of health.warnings) once(text, fix);
  for (const { kind, file, note } of health.damaged) {
    once(
      `Something kept was damaged (${kind}) and is now in ${file}.`,
      note ?? "Restore it from a backup, or make it anew: see “What is kept” in the manual.",
    );
  }
}

/** @param {string} text @param {string} fix */
function once(text, fix) {
  if (shownTexts.has(text)) return;
  shownTexts.add(text);
  notify({ level: "warn", text, fix });
}
