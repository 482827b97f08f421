// Where a camera's lines have moved to, and how far it had moved in the last hours: asked for while its page is open.
import { computed, signal } from "@preact/signals";
import { call, online } from "../../core/api.js";
import { polling } from "../../core/polling.js";
import { route } from "../../core/route.js";
import { FACTORS } from "../compare/residual_arrows.js";
import { statuses } from "../live/camera_status.js";
import { rowsOf } from "./timeline.js";

/**
 * @typedef {import("../../core/types").Displacement} Displacement
 * @typedef {import("../../core/types").Happening} Happening
 */

const PLACES_MS = 1000, // the camera is looked at once a second
  EVENTS_MS = 5000,
  EVENTS = 200;
const READABLE = 1 / 14; // of the picture's diagonal: so long is the longest arrow

const answered = signal(/** @type {{ camera: string, now: Displacement } | null} */ (null));
const happened = signal(/** @type {Happening[]} */ ([]));

/** The camera whose page is open, "" none. */
const camera = computed(() => (route.value.view === "drift" ? (route.value.camera ?? "") : ""));

/** Of the camera on show; null until the server has answered. */
export const displacement = computed(() =>
  answered.value?.camera === camera.value ? answered.value.now : null,
);

/** The longest displacement on the carpet, mm, and the arrows' length on the picture. */
export const longestArrow = computed(() => {
  const { places = [], image_size: size = null } = displacement.value ?? {};
  const mm = Math.max(0, ...places.map((place) => place.mm)),
    px = Math.max(0, ...places.map(({ was, now }) => Math.hypot(now[0] - was[0], now[1] - was[1]))),
    diagonal = Math.hypot(...(size ?? [0, 0]));
  return { mm, times: FACTORS.findLast((f) => px * f <= READABLE * diagonal) ?? FACTORS[0] };
});

/** The time line, oldest first. */
export const rows = computed(() => {
  const it = displacement.value;
  return it
    ? rowsOf(
        it.history,
        happened.value.filter((event) => event.camera === camera.value),
        it.entry_s,
      )
    : [];
});

const places = polling(
  async () => {
    const id = camera.value,
      before = displacement.value,
      since = before?.history.at(-1)?.at ?? 0;
    if (!id) return;
    const now = await call("GET", `/cameras/${encodeURIComponent(id)}/drift?since=${since}`);
    // the newest entry comes again as long as it grows; without one, the camera was started anew
    if (before && now.history.length)
      now.history = [...before.history.filter(({ at }) => at < now.history[0].at), ...now.history];
    answered.value = { camera: id, now };
  },
  () => (online.value && camera.value ? PLACES_MS : 0),
);
/** What is told as an event as soon as the status shows it. */
const driftState = computed(() => {
  const { state, drift, active_calibration: active } = statuses.value[camera.value] ?? {};
  return [camera.value, state, drift?.state, active].join();
});
const events = polling(
  async () => {
    happened.value = (await call("GET", `/events?limit=${EVENTS}`)).items;
  },
  () => {
    void driftState.value;
    return online.value && camera.value ? EVENTS_MS : 0;
  },
);

/** Keep both fresh from now on, while they are shown. */
export function startDisplacement() {
  places.start();
  events.start();
}
