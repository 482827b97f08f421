// Who else has this picture open, and whether somebody has just saved its draft, over a WebSocket.
import { effect, signal, untracked } from "@preact/signals";
import { online } from "../../core/api.js";
import { operatorName } from "../../core/operator.js";
import { openSocket } from "../../core/socket.js";
import { snapshot } from "../../core/state.js";
import { fetchOthersChanges } from "./draft.js";

/** Their names, "" for one who gave none. */
export const others = signal(/** @type {string[]} */ ([]));

/** Tell and hear who is at the picture that is open, from now on. */
export function startPresence() {
  /** @type {import("../../core/socket.js").Socket | null} */
  let socket = null;
  effect(() => {
    const id = snapshot.value?.id,
      name = operatorName.value;
    socket?.close();
    socket = null;
    others.value = [];
    if (id && online.value)
      untracked(() => {
        socket = open(id, name);
      });
  });

  /** @param {string} id @param {string} name */
  function open(id, name) {
    return openSocket(`/drafts/${encodeURIComponent(id)}/stream?name=${encodeURIComponent(name)}`, {
      onMessage: (now) => {
        others.value = now.others ?? [];
        if (now.etag) void fetchOthersChanges(now.etag, now.by);
      },
      onBreak: () => {
        others.value = [];
      },
    });
  }
}
