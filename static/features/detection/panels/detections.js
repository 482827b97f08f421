// The list of detections, notes on them, and whether they are published.
import { capitalised, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf } from "../../../core/route.js";
import { t } from "../../../core/words.js";
import { Title } from "../../../ui/title.js";
import { colourName, publish } from "../colours.js";
import { detectionCamera, detectionState, setDetection } from "../detection.js";
import { detections, heldFrame } from "../held_frame.js";
import { HeightsUsed } from "../../referee/panels/heights_used.js";

/** @typedef {import("../types").Item} Item */

const ORDER = { ball: 0, robot: 1, marker: 2 };

/** @param {Item} a @param {Item} b */
const inOrder = (a, b) =>
  ORDER[a.kind] - ORDER[b.kind] ||
  (a.team ?? "").localeCompare(b.team ?? "") ||
  (a.id ?? 999) - (b.id ?? 999);

/** Of one coordinate, mm. @param {Item["covariance_mm2"]} c */
const sigma = (c) => (c ? Math.sqrt((c[0][0] + c[1][1]) / 2) : null);

/** @param {Item} it */
const called = (it) => {
  if (it.kind === "ball") return t("detection.seen.ball");
  const team = it.team && capitalised(colourName(it.team)),
    id = it.id ?? "?";
  if (it.kind === "marker")
    return team ? t("detection.seen.team-patch", { team }) : t("detection.seen.patch");
  return team ? `${team} ${id}` : t("detection.seen.robot", { id });
};

export function DetectionReport() {
  const it = detectionState.value,
    now = detections.value;
  if (!detectionCamera.value || !it) return null;
  const items = (now?.items ?? []).toSorted(inOrder),
    hasPlaces = items.some((i) => i.x_mm !== null);
  return html`
    <section aria-label=${t("detection.seen.now")}>
      <${Title} of="seen" about=${t("detection.seen.about")}>
        ${heldFrame.value ? t("detection.seen.held") : t("detection.seen.now")}
      <//>
      ${
        !it.on
          ? html`<p class="reason">${t("detection.seen.off")}</p>`
          : !items.length
            ? html`<p class="reason">
          ${now ? t("detection.seen.nothing") : t("detection.waiting")}
        </p>`
            : html`
          <table class="seen-table" data-testid="seen">
            <thead>
              <tr>
                <th scope="col">${t("detection.seen.what")}</th>
                ${
                  hasPlaces
                    ? html`
                    <th scope="col">x mm</th>
                    <th scope="col">y mm</th>
                    <th scope="col">
                      <abbr title=${t("detection.seen.sigma")}>± mm</abbr>
                    </th>
                  `
                    : html`
                    <th scope="col">x px</th>
                    <th scope="col">y px</th>
                  `
                }
                <th scope="col">
                  <abbr title=${t("detection.seen.front.help")}>${t("detection.seen.front")}</abbr>
                </th>
              </tr>
            </thead>
            <tbody>
              ${items.map(
                (item, i) => html`<tr key=${i} data-testid="seen-row" data-kind=${item.kind}>
                <th scope="row">
                  <i
                    class="dot"
                    data-team=${item.kind === "ball" ? "ball" : (item.team ?? "")}
                    aria-hidden="true"
                  ></i>
                  ${called(item)}
                </th>
                ${
                  hasPlaces
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
                  `
                }
                <td>${number(item.orientation_deg, 0)}</td>
              </tr>`,
              )}
            </tbody>
          </table>
          ${
            items.some((i) => i.on_carpet && i.kind === "robot") &&
            html`<p class="reason">
            ${t("detection.seen.on-carpet")}
          </p>`
          }
        `
      }
      ${(now?.notes ?? []).map(
        (note) => html`<p key=${note} class="warning-line">
        ${note}
      </p>`,
      )}
      <label class="line switch-line">
        <input
          type="checkbox"
          data-testid="seeing-on"
          checked=${it.on}
          onChange=${(/** @type {any} */ e) => void setDetection({ on: e.target.checked })}
        />${" "}
        ${t("detection.seen.switch")}
      </label>
      <p class="reason">${t("detection.seen.switch.when")}</p>
    </section>
    <section aria-label=${t("referee.title")}>
      <${Title} of="robot-heights">${t("referee.title")}<//>
      <${HeightsUsed} teams=${it.teams} />
      <p class="reason">
        <a href=${addressOf("publishing")}>${t("referee.change")}</a>
      </p>
    </section>
    <section aria-label=${t("detection.publish.section")}>
      <${Title} of="seen-published" about=${t("detection.publish.about")}>
        ${t("detection.publish.title")}
      <//>
      <label class="line switch-line">
        <input
          type="checkbox"
          data-testid="publish"
          checked=${it.publish}
          disabled=${!it.on}
          onChange=${(/** @type {any} */ e) => void publish(e.target.checked)}
        />${" "}
        ${t("detection.publish.switch")}
      </label>
      <p class="reason" data-testid="publish-words">
        ${
          it.publish
            ? html`
            ${t("detection.publish.on")}${" "}
            ${
              it.published.packets
                ? t("detection.publish.sent", { count: it.published.packets })
                : t("detection.publish.sent-nothing")
            }
          `
            : t("detection.publish.off")
        }
      </p>
      ${
        it.publish &&
        it.published.problem &&
        html`<div class="warning-line" role="status" data-testid="publish-problem">
          <b>${it.published.problem.what}</b> ${it.published.problem.fix}
        </div>`
      }
    </section>
  `;
}
