// How a stream is, over its picture: a badge, and in words what is wrong.
import { number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { STATES, statuses } from "../camera_status.js";

/** @typedef {ReturnType<typeof import("./live_stream.js").useLiveStream>["problem"]} Problem */

/**
 * As the server knows it, unless this browser cannot draw it; nothing is called live before it is drawn here.
 * @param {string} id @param {Problem} problem @param {unknown} head of the frame that is drawn, if there is one
 */
export function stateOf(id, problem, head) {
  if (problem?.isUndrawn) return "undrawn";
  const state = statuses.value[id]?.state ?? "connecting";
  return state === "live" && !head ? "connecting" : state;
}

/**
 * isOld: whether its picture is.
 * @param {{ id: string, state: keyof typeof STATES, problem: Problem, isOld?: boolean }} props
 */
export function StreamState({ id, state, problem, isOld = false }) {
  const status = statuses.value[id];
  const wrong =
    problem ?? (status?.problem && { detail: status.problem.what, fix: status.problem.fix });
  return html`
    <span class="badge" aria-hidden="true" data-is=${state} data-testid=${`state-${id}`}>
      ${STATES[state]}
      ${
        state === "live" && status
          ? html`
          ${" "}
          <small>${t("live.frame-rate", { rate: number(status.fps, status.fps < 10 ? 1 : 0) })}</small>
        `
          : ""
      }
      ${
        isOld && status?.frame_age_s
          ? html`
          ${" "}
          <small>${t("live.picture-age", { age: number(status.frame_age_s, 0) })}</small>
        `
          : ""
      }
    </span>
    ${
      wrong &&
      state !== "mismatch" &&
      html`<p class="wrong" role="status">
      <b>${wrong.detail}</b> ${wrong.fix}
    </p>`
    }
  `;
}
