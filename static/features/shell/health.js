// How the server is and what it claims of the site: asked for as long as the page is open, for the list of problems.
import { online } from "../../core/api.js";
import { polling } from "../../core/polling.js";
import { startStatuses } from "../live/camera_status.js";
import { followNetwork } from "../league/network.js";
import { fetchHealth } from "../settings/settings.js";
import { startReadiness } from "./readiness.js";

const EVERY_MS = 60_000;
const ofServer = polling(fetchHealth, () => (online.value ? EVERY_MS : 0));

/** Look now, whenever the server is back, and again from then on. */
export function startHealth() {
  ofServer.start();
  followNetwork();
  startStatuses();
  startReadiness();
}
