// How the server is, and what it publishes: asked for as long as the page is open, for the list of problems.
import { effect } from "@preact/signals";
import { online } from "../../core/api.js";
import { startStatuses } from "../live/camera_status.js";
import { followNetwork } from "../network/network.js";
import { fetchHealth } from "../settings/settings.js";

const EVERY_MS = 60_000;

/** Look now, whenever the server is back, and again from then on. */
export function startHealth() {
  effect(() => {
    if (online.value) void fetchHealth();
  });
  setInterval(() => {
    if (online.value && !document.hidden) void fetchHealth();
  }, EVERY_MS);
  followNetwork();
  startStatuses();
}
