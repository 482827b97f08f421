// The operator's name, as given in this browser: saved beside what they make, and shown to whoever has the same picture
// open.
import { signal } from "@preact/signals";

const KEPT = "touchline.operator";
export const MAX_NAME_LENGTH = 64;

export const operatorName = signal(read());

/** @param {string} name */
export function chooseName(name) {
  operatorName.value = name.trim().slice(0, MAX_NAME_LENGTH);
  try {
    localStorage.setItem(KEPT, operatorName.value);
  } catch {
    /* a full or forbidden store: only a reload forgets it */
  }
}

function read() {
  try {
    return localStorage.getItem(KEPT) ?? "";
  } catch {
    return "";
  }
}

/** What a request's header may carry: Latin letters as they are, others as ?. */
export const headerName = () => operatorName.value.replace(/[^\x20-\x7e\u00a0-\u00ff]/g, "?");
