// Status of all cameras, polled as long as the page is open, and the addresses of their streams.
import { computed, signal } from "@preact/signals";
import { address, call } from "../../core/api.js";
import { polling } from "../../core/polling.js";
import { route } from "../../core/route.js";
import { cameras } from "../../core/state.js";
import { t } from "../../core/words.js";
import { refreshCameras, refreshFields } from "../calibrate/pictures.js";

/** @typedef {import("../../core/types").CameraStatus} CameraStatus */

const LOOKED_AT_MS = 1000,
  EVERY_MS = 2000; // a knock is told after two looks of the camera's own, one a second

/** By camera. */
export const statuses = signal(/** @type {Record<string, CameraStatus>} */ ({}));
/** The cameras that are looked at: all on the wall, one on its own views. */
const lookedAt = computed(() => {
  const { view, camera } = route.value;
  return view === "wall" ? cameras.value.map((c) => c.id).join(" ") : camera;
});
/** How many backups the server had restored. */
let restored = Infinity;

/** Keep all statuses fresh from now on, and at once where others are looked at: those are started. */
export const { start: startStatuses, ask: refreshStatuses } = polling(look, () =>
  lookedAt.value ? LOOKED_AT_MS : EVERY_MS,
);

async function look() {
  /** @type {(CameraStatus & { id: string })[]} */
  let items, revision;
  try {
    const answer = await call("GET", "/cameras/status");
    if (answer.restored > restored) location.reload(); // what was read before may be gone
    ({ items, fields: revision, restored } = answer);
  } catch {
    statuses.value = Object.fromEntries(
      Object.entries(statuses.value).map(([id, it]) => [id, lost(it)]),
    );
    return;
  }
  statuses.value = Object.fromEntries(items.map((it) => [it.id, it]));
  const idle = lookedAt.value.split(" ").filter((id) => statuses.value[id]?.state === "idle");
  await Promise.allSettled([
    refreshCameras(items),
    refreshFields(revision),
    ...idle.map((id) => call("GET", `/cameras/${encodeURIComponent(id)}/status`)), // that starts it
  ]);
}

/** @param {CameraStatus} before @returns {CameraStatus} */
const lost = (before) => ({
  ...before,
  state: "offline",
  words: [],
  problem: {
    reason: "server-gone",
    what: t("common.server-silent"),
    fix: t("live.server-gone.fix"),
  },
});

/** How wide one camera's picture is streamed that is not looked at closely: one width, so that viewers share it. */
export const VIEW_PX = 960;

/**
 * A stream's address. fps: at most; 0 all.
 * @param {string} id
 * @param {string} view
 * @param {number} width
 * @param {number} fps
 */
export function streamAddress(id, view, width, fps = 0) {
  const to = new URL(
    address(
      `/cameras/${encodeURIComponent(id)}/stream?view=${view}&width=${width}&ack=true${fps ? `&fps=${fps}` : ""}`,
    ),
    location.href,
  );
  to.protocol = to.protocol.replace("http", "ws");
  return to.href;
}

/** What a state is called. */
export const STATES = {
  idle: t("live.state.idle"),
  connecting: t("live.state.connecting"),
  live: t("live.state.live"),
  stalled: t("live.state.stalled"),
  offline: t("live.state.offline"),
  mismatch: t("live.state.mismatch"),
  undrawn: t("live.state.undrawn"), // known to this browser alone
};
