// What rolls have measured of the ball, as the ball model that a camera's publication sends.
import { request } from "../../core/api.js";
import { notify, notifyError } from "../../core/state.js";
import { t } from "../../core/words.js";

/** @typedef {import("../straight/types").Deceleration} Deceleration */

/**
 * Send it with the camera's geometry from now on; what was not measured stays as it was entered.
 * @param {string} camera
 * @param {Deceleration} found
 */
export async function publishDeceleration(camera, found) {
  try {
    const { path, now, etag } = await publicationOf(camera);
    const known = now.ball_models?.straight_two_phase ?? {};
    const labels = {
      acc_slide: t("network.ball.acc-slide"),
      acc_roll: t("network.ball.acc-roll"),
      k_switch: t("network.ball.k-switch"),
    };
    const names = /** @type {const} */ (["acc_slide", "acc_roll", "k_switch"]);
    const values = Object.fromEntries(
      names.map((name) => [name, rounded(found[name]?.value ?? known[name])]),
    );
    const missing = names.filter((name) => values[name] === undefined);
    if (missing.length) {
      notify({
        level: "warn",
        text: t("rolling.deceleration.missing", {
          values: missing.map((name) => labels[name]).join(", "),
        }),
        fix: t("rolling.deceleration.missing.fix"),
      });
      return;
    }
    const none = { straight_two_phase: null, chip_fixed_loss: null };
    await request("PUT", path, {
      json: { ball_models: { ...none, ...now.ball_models, straight_two_phase: values } },
      headers: etag ? { "If-Match": etag } : {},
    });
    notify({
      level: "info",
      text: t("rolling.deceleration.used"),
      fix: t("rolling.deceleration.where"),
    });
  } catch (error) {
    notifyError(error);
  }
}

/** @param {number | undefined} value */
const rounded = (value) => (value === undefined ? value : Number(value.toFixed(4)));

/** The publication in which a camera is, its settings and their ETag. @param {string} camera */
async function publicationOf(camera) {
  const paths = ["/publishing"];
  for (const path of paths) {
    const answer = await request("GET", path);
    const now = /** @type {import("./types").Publishing} */ (await answer.json());
    if (now.members.includes(camera)) return { path, now, etag: answer.headers.get("ETag") };
    if (paths.length === 1)
      for (const rig of now.rigs.filter(({ separate }) => separate))
        paths.push(`/publishing?rig=${encodeURIComponent(rig.name)}`);
  }
  throw new Error(camera); // it was removed
}
