// What the server claims of the site before a match, and what has happened lately.
import { computed, signal } from "@preact/signals";
import { call, online } from "../../core/api.js";
import { polling } from "../../core/polling.js";
import { route } from "../../core/route.js";
import { cameras } from "../../core/state.js";
import { statuses } from "../live/camera_status.js";

/** @typedef {import("../verify/types").Claim} Claim */

const WALL_MS = 2000, // a knock is told by the second look after it
  ELSEWHERE_MS = 10_000,
  EVENTS_MS = 5000,
  EVENTS = 6;

/** Null until the server has answered. */
export const readiness = signal(
  /** @type {{ gate: import("../verify/types").Gate, items: Claim[] } | null} */ (null),
);

export const events = signal(
  /** @type {{ at: string, kind: string, text: string, by: string | null }[]} */ ([]),
);

/** What it depends on and this page learns sooner. */
const changes = computed(() =>
  JSON.stringify([
    cameras.value.map(({ id, active }) => [id, active?.id, active?.field_changes]),
    Object.values(statuses.value).map(({ state, drift }) => [state, drift?.state]),
  ]),
);

const claims = polling(
  async () => {
    readiness.value = await call("GET", "/readiness");
  },
  () => {
    void changes.value;
    if (!online.value) return 0;
    return route.value.view === "wall" ? WALL_MS : ELSEWHERE_MS;
  },
);
const happenings = polling(
  async () => {
    events.value = (await call("GET", `/events?limit=${EVENTS}`)).items;
  },
  () => (online.value && route.value.view === "wall" ? EVENTS_MS : 0),
);

/** Keep both fresh from now on, the second where it is shown. */
export function startReadiness() {
  claims.start();
  happenings.start();
}
