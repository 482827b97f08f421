// Geometry on the league's multicast group: published and received, polled while the panel is open.
import { computed, signal } from "@preact/signals";
import { call, online, Problem, request } from "../../core/api.js";
import { requestOrder } from "../../core/latest_wins.js";
import { polling } from "../../core/polling.js";
import { route } from "../../core/route.js";
import { notify, notifyError } from "../../core/state.js";
import { t } from "../../core/words.js";
import { activateCalibration } from "../versions/activate.js";

/**
 * @typedef {import("./types").Publishing} Publishing
 * @typedef {import("./types").GeometrySender} GeometrySender
 * @typedef {import("./types").ReceivedCamera} ReceivedCamera
 */

const LOOK_MS = 2000;

export const publishing = signal(/** @type {Publishing | null} */ (null));
export const receivedGeometry = signal(
  /** @type {import("./types").ReceivedGeometry | null} */ (null),
);
/** The rig that is shown, of those that are published separately; "": the cameras of no such rig. */
export const shownRig = signal("");
const changes = requestOrder(),
  underway = signal(0);
/** The ETag of the settings on show, and the end of the changes that are under way: each is made from the last. */
let seen = "",
  queue = Promise.resolve();
/** Whether a change is under way. */
export const changing = computed(() => underway.value > 0);

/** Who else publishes another calibration for a camera number of ours. */
export const contradictions = computed(() =>
  (receivedGeometry.value?.items ?? []).flatMap((sender) =>
    sender.cameras.filter((c) => c.contradicts).map((camera) => ({ sender, camera })),
  ),
);

/** Keep both fresh while they are shown. */
export const { start: followNetwork } = polling(refreshNetwork, () =>
  route.value.view === "publishing" && online.value && !changing.value ? LOOK_MS : 0,
);

export async function refreshNetwork() {
  const isStill = changes.since(),
    rig = shownRig.value;
  try {
    const [found, others] = await Promise.all([
      request("GET", ofShownRig("/publishing")),
      call("GET", ofShownRig("/publishing/heard")),
    ]);
    const state = await found.json();
    if (!isStill() || rig !== shownRig.value) return; // it is older than what was asked for since
    receivedGeometry.value = others;
    publishing.value = state;
    seen = etagOf(found);
  } catch (error) {
    // another user has ended it, or deleted the rig; a silent server is told elsewhere
    if (error instanceof Problem && error.status === 404 && rig) showRig("");
  }
}

/** @param {string} path of the publication that is shown */
export const ofShownRig = (path) =>
  shownRig.value ? `${path}?rig=${encodeURIComponent(shownRig.value)}` : path;

/** @param {string} rig published separately, or "" */
export function showRig(rig) {
  shownRig.value = rig;
  void refreshNetwork();
}

/** Publish a rig separately from now on, switched off at first. @param {string} rig */
export async function separateRig(rig) {
  try {
    await request("PUT", `/publishing?rig=${encodeURIComponent(rig)}`, { json: {} });
    showRig(rig);
  } catch (error) {
    notifyError(error);
  }
}

/** Publish the rig that is shown with all others again. */
export async function endSeparateRig() {
  try {
    await request("DELETE", ofShownRig("/publishing"), {
      headers: seen ? { "If-Match": seen } : {},
    });
    showRig("");
  } catch (error) {
    notifyError(error);
  }
}

const etagOf = (/** @type {Response} */ answer) => answer.headers.get("ETag") ?? "";

/**
 * Change some of what is on show; refused where somebody else has changed it since.
 * @param {Record<string, unknown>} wanted
 */
export const setPublishing = (wanted) =>
  change(() =>
    request("PUT", ofShownRig("/publishing"), {
      json: wanted,
      headers: seen ? { "If-Match": seen } : {},
    }),
  );

/** Publish although another program does. */
export const confirmPublishing = () =>
  change(() => request("POST", ofShownRig("/publishing/confirm")));

/** @param {() => Promise<Response>} ask which answers with the state */
async function change(ask) {
  const isNewest = changes.begin();
  underway.value += 1;
  queue = queue.then(async () => {
    try {
      const answer = await ask();
      seen = etagOf(answer);
      const now = await answer.json();
      if (isNewest()) publishing.value = now;
    } catch (error) {
      if (publishing.value) publishing.value = { ...publishing.value }; // draw what stands
      notifyError(error);
    }
  });
  await queue;
  underway.value -= 1;
  await refreshNetwork();
}

/**
 * The ball models in a file; null, and the reason shown, where it has none.
 * @param {File} file
 * @returns {Promise<import("./types").BallModels | null>}
 */
export const readBallModels = async (file) =>
  (await answerTo("/publishing/ball-models/read", file))?.ball_models ?? null;

/**
 * ssl-vision's settings with what is published; null, and the reason shown, where that cannot be.
 * @param {File} file
 * @returns {Promise<{ content: string, cameras: number[], notes: { text: string }[] } | null>}
 */
export const updateSslVisionSettings = (file) =>
  answerTo(ofShownRig("/publishing/ssl-vision-settings"), file);

/** @param {string} path @param {File} file @returns {Promise<any>} null, and the reason shown, where it is refused */
async function answerTo(path, file) {
  const body = new FormData();
  body.append("file", file, file.name);
  try {
    return await (await request("POST", path, { body })).json();
  } catch (error) {
    notifyError(error);
    return null;
  }
}

/**
 * Keep what a sender says of one camera as a version of ours.
 * @param {GeometrySender} sender
 * @param {ReceivedCamera} camera
 * @param {string} name
 */
export async function saveReceived(sender, camera, name) {
  try {
    const made = await call("POST", ofShownRig(`/publishing/heard/${sender.id}/import`), {
      camera_id: camera.camera_id,
      camera: name,
      sha256: sender.sha256,
    });
    const activate = async () => {
      if (await activateCalibration({ id: made.id, version: made.version, camera: name }))
        await refreshNetwork();
    };
    notify({
      level: "info",
      text: t("network.kept", {
        number: camera.camera_id,
        sender: sender.address,
        version: made.version,
        camera: name,
      }),
      fix: t("network.kept.fix"),
      about: `active/${name}`, // it is not active yet
      action: { label: t("network.kept.activate"), run: () => void activate() },
    });
  } catch (error) {
    notifyError(error);
  }
}
