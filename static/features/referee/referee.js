// The game controller, the teams and the table of robot heights, polled while the page that shows them is open.
import { computed, signal } from "@preact/signals";
import { online, request } from "../../core/api.js";
import { requestOrder } from "../../core/latest_wins.js";
import { polling } from "../../core/polling.js";
import { route } from "../../core/route.js";
import { notifyError } from "../../core/state.js";

const LOOK_MS = 2000;
export const referee = signal(/** @type {import("./types").Referee | null} */ (null));
const changes = requestOrder(),
  underway = signal(0);
/** The ETag of the settings on show, and the end of the changes that are under way: each is made from the last. */
let seen = "",
  queue = Promise.resolve();
/** Whether a change is under way. */
export const changing = computed(() => underway.value > 0);

export const { start: startReferee } = polling(refresh, () =>
  route.value.view === "publishing" && online.value && !changing.value ? LOOK_MS : 0,
);

/** @param {Response} answer */
async function show(answer) {
  referee.value = await answer.json();
  seen = answer.headers.get("ETag") ?? "";
}

async function refresh() {
  const isStill = changes.since();
  const answer = await request("GET", "/referee");
  if (isStill()) await show(answer);
}

/** @param {"PUT" | "POST"} method @param {string} path @param {{ json?: unknown, body?: FormData }} what */
async function change(method, path, what) {
  changes.begin();
  underway.value += 1;
  queue = queue.then(async () => {
    const headers = /** @type {Record<string, string>} */ (seen ? { "If-Match": seen } : {});
    try {
      await show(await request(method, path, { ...what, headers }));
    } catch (error) {
      if (referee.value) referee.value = { ...referee.value }; // draw what stands
      notifyError(error);
    }
  });
  await queue;
  underway.value -= 1;
  await refresh().catch(() => {}); // what somebody else has changed is on show then
}

/** Change some of what is on show; refused where somebody else has changed it since.
 * @param {Record<string, unknown>} json */
export const setReferee = (json) => change("PUT", "/referee", { json });

/** Add a robot-heights.yml to the table. @param {File} file */
export function addHeights(file) {
  const body = new FormData();
  body.append("file", file);
  return change("POST", "/referee/robot-heights", { body });
}
