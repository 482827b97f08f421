// Who else has this picture open, and whether somebody has just saved its draft: told by the server at once.
import { effect, signal, untracked } from "@preact/signals";
import { address, online } from "./api.js";
import { lookAgain } from "./draft.js";
import { operatorName } from "./operator.js";
import { snapshot } from "./state.js";

const AGAIN_MS = 2000;

/** Their names, "" for one who gave none. */
export const others = signal(/** @type {string[]} */ ([]));

/** Tell and hear who is at the picture that is open, from now on. */
export function startPresence() {
  /** @type {WebSocket | null} */
  let line = null;
  let timer = 0;
  effect(() => {
    const id = snapshot.value?.id, name = operatorName.value;
    clearTimeout(timer);
    line?.close();
    line = null;
    others.value = [];
    if (id && online.value) untracked(() => open(id, name));
  });

  /** @param {string} id @param {string} name */
  function open(id, name) {
    const to = line = new WebSocket(address(`/drafts/${encodeURIComponent(id)}/stream?name=${encodeURIComponent(name)}`));
    to.addEventListener("message", ({ data }) => {
      if (line !== to) return;
      const told = JSON.parse(data);
      others.value = told.others ?? [];
      if (told.etag) void lookAgain(told.etag, told.by);
    });
    to.addEventListener("close", () => {
      if (line !== to) return;
      others.value = [];
      timer = setTimeout(() => { if (line === to) open(id, name); }, AGAIN_MS);
    });
  }
}
