// The list of detections, notes on them, and whether they are published.
import { number, plural } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { Title } from "../../../ui/title.js";
import { publish } from "../colours.js";
import { detectionCamera, detectionState, setDetection } from "../detection.js";
import { detections, heldFrame } from "../held_frame.js";

/** @typedef {import("../types").Item} Item */

const ORDER = { ball: 0, robot: 1, marker: 2 };

/** @param {Item} a @param {Item} b */
const inOrder = (a, b) =>
  ORDER[a.kind] - ORDER[b.kind] || (a.team ?? "").localeCompare(b.team ?? "") || (a.id ?? 999) - (b.id ?? 999);

/** Of one coordinate, mm. @param {Item["covariance_mm2"]} c */
const sigma = (c) => (c ? Math.sqrt((c[0][0] + c[1][1]) / 2) : null);

/** @param {Item} it */
const called = (it) =>
  it.kind === "ball"
    ? "Ball"
    : `${it.team ? it.team[0].toUpperCase() + it.team.slice(1) : "Robot"} ` +
      `${it.kind === "marker" ? "patch" : (it.id ?? "?")}`;

export function DetectionReport() {
  const it = detectionState.value,
    now = detections.value;
  if (!detectionCamera.value || !it) return null;
  const items = (now?.items ?? []).toSorted(inOrder),
    hasPlaces = items.some((i) => i.x_mm !== null);
  return html`
    <section aria-label="Seen now">
      <${Title} of="seen" about="what is seen now">
        ${heldFrame.value ? "Seen in the held frame" : "Seen now"}
      <//>
      ${!it.on
        ? html`<p class="reason">Seeing is switched off for this camera.</p>`
        : !items.length
        ? html`<p class="reason">
          ${now ? "Nothing is found. Look at the mask: are the colours named?" : "Waiting for the camera…"}
        </p>`
        : html`
          <table class="seen-table" data-testid="seen">
            <thead>
              <tr>
                <th scope="col">What</th>
                ${hasPlaces
                  ? html`
                    <th scope="col">x mm</th>
                    <th scope="col">y mm</th>
                    <th scope="col">
                      <abbr title="standard deviation of one coordinate, mm">± mm</abbr>
                    </th>
                  `
                  : html`
                    <th scope="col">x px</th>
                    <th scope="col">y px</th>
                  `}
                <th scope="col">
                  <abbr title="where its front looks, counter-clockwise from field x">front °</abbr>
                </th>
              </tr>
            </thead>
            <tbody>
              ${items.map((item, i) => html`<tr key=${i} data-testid="seen-row" data-kind=${item.kind}>
                <th scope="row">
                  <i
                    class="dot"
                    data-team=${item.kind === "ball" ? "ball" : (item.team ?? "")}
                    aria-hidden="true"
                  ></i>
                  ${called(item)}
                </th>
                ${hasPlaces
                  ? html`
                    <td>
                      ${number(item.x_mm, 0)}
                      ${item.on_carpet && item.kind === "robot" ? "*" : ""}
                    </td>
                    <td>${number(item.y_mm, 0)}</td>
                    <td>${number(sigma(item.covariance_mm2), 1)}</td>
                  `
                  : html`
                    <td>${number(item.pixel[0], 1)}</td>
                    <td>${number(item.pixel[1], 1)}</td>
                  `}
                <td>${number(item.orientation_deg, 0)}</td>
              </tr>`)}
            </tbody>
          </table>
          ${items.some((i) => i.on_carpet && i.kind === "robot") && html`<p class="reason">
            * where the line of sight meets the carpet: this model does not know how high a robot is.
          </p>`}
        `}
      ${(now?.notes ?? []).map((note) => html`<p key=${note} class="warning-line">
        ${note}
      </p>`)}
      <label class="line switch-line">
        <input
          type="checkbox"
          data-testid="seeing-on"
          checked=${it.on}
          onChange=${(/** @type {any} */ e) => void setDetection({ on: e.target.checked })}
        />${" "}
        See with this camera
      </label>
      <p class="reason">Only while somebody looks, or while it is sent to the network.</p>
    </section>
    <section aria-label="Network">
      <${Title} of="seen-published" about="sending what is seen">
        Send what is seen
      <//>
      <label class="line switch-line">
        <input
          type="checkbox"
          data-testid="publish"
          checked=${it.publish}
          disabled=${!it.on}
          onChange=${(/** @type {any} */ e) => void publish(e.target.checked)}
        />${" "}
        Send each frame as SSL_DetectionFrame
      </label>
      <p class="reason" data-testid="publish-words">
        ${it.publish
          ? html`
            Every frame goes to the multicast group that is set under Network on the start page: all teams
            that listen there take it for the game.${" "}
            ${it.published.packets ? plural(it.published.packets, "packet") : "Nothing"} sent so far.
          `
          : (
          "Off: nothing leaves this machine. On: every frame goes to the league's multicast group, as SSL-Vision " +
            "sends it, and whoever listens there takes it for the game. It needs an active calibration."
        )}
      </p>
      ${it.publish && it.published.problem && 
        html`<div class="warning-line" role="status" data-testid="publish-problem">
          <b>${it.published.problem.what}</b> ${it.published.problem.fix}
        </div>`}
    </section>
  `;
}
