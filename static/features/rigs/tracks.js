// Tracks on a rig's field, merged over its cameras; streamed only while they are shown.
import { computed, effect, signal } from "@preact/signals";
import { online } from "../../core/api.js";
import { route } from "../../core/route.js";
import { openSocket } from "../../core/socket.js";
import { t } from "../../core/words.js";
import { rig } from "./rig.js";

/**
 * @typedef {{ track: number, kind: "ball" | "robot" | "marker", team: string | null, id: number | null, x_mm: number,
 * y_mm: number, orientation_deg: number | null, cameras: string[], seam_mm: number | null }} Track
 * @typedef {{ items: Track[], seams: { things: number, median_mm: number | null, max_mm: number | null }, cameras: {
 * camera: string, problem: { what: string, fix: string } | null }[] }} Tracks */

/** Whether what plays is wanted. */
export const following = signal(false);
/** The newest of the rig on show. */
export const tracks = signal(/** @type {Tracks | null} */ (null));
/** Why there is none. */
export const tracksRefusal = signal(
  /** @type {import("../../core/types").Refusal | null} */ (null),
);
/** The rig on show; points may be matched in two of its cameras meanwhile. */
const atRig = computed(() => (route.value.view === "rig" ? (rig.value?.name ?? null) : null));
const wanted = computed(() => (following.value && online.value ? atRig.value : null));

/** Open and close the line as it is wanted. */
export function startTracks() {
  let socket = /** @type {import("../../core/socket.js").Socket | null} */ (null);
  effect(() => {
    const name = wanted.value;
    socket?.close();
    socket = tracks.value = tracksRefusal.value = null;
    if (name !== null) socket = listen(name);
  });

  /** @param {string} name */
  function listen(name) {
    return openSocket(`/rigs/${encodeURIComponent(name)}/tracks`, {
      onMessage: (now) => {
        tracksRefusal.value = "detail" in now ? now : null;
        if (!tracksRefusal.value) tracks.value = now;
      },
    });
  }
}

/** @type {import("../../core/actions.js").Action[]} */
export const TRACK_ACTIONS = [
  {
    id: "follow-play",
    label: t("rig.action.follow"),
    short: t("rig.action.follow.short"),
    group: "pages",
    run: () => {
      following.value = !following.value;
    },
    enabled: () => atRig.value !== null,
    pressed: () => following.value,
  },
];
