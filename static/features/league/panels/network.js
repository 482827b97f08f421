// The network: whether geometry is published, over which interface, the loss of each camera, and other senders.
import { signal } from "@preact/signals";
import { mm, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { cameras, fields, modelTitle } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { rich } from "../../../ui/rich.js";
import { Title } from "../../../ui/title.js";
import { Typed } from "../../../ui/typed.js";
import {
  changing,
  contradictions,
  publishing,
  receivedGeometry,
  saveReceived,
  setPublishing,
} from "../network.js";
import { RobotHeights } from "../../referee/panels/robot_heights.js";
import { Asking } from "./asking.js";
import { BallModelSettings } from "./ball_models.js";
import { ProgramFiles } from "./files.js";
import { Publications } from "./publications.js";
import { SentPlan } from "./sent_plan.js";

/** @typedef {import("../types").Publishing} Publishing @typedef {import("../types").PublishedCamera} PublishedCamera */
/**
 * @typedef {import("../types").GeometrySender} GeometrySender
 * @typedef {import("../types").ReceivedCamera} ReceivedCamera
 */

const STATES = {
  off: t("network.state.off"),
  starting: t("network.state.starting"),
  asking: t("network.state.asking"),
  "on-air": t("network.state.on-air"),
  silent: t("network.state.silent"),
  failing: t("network.state.failing"),
};
/** For which of our cameras a heard one is to be kept, by sender and number. */
const LEAST_MM = 0.1; // of an upper limit
const targets = signal(/** @type {Record<string, string>} */ ({}));

export function PublishingPage() {
  const it = publishing.value;
  if (!it) return null;
  return html`<div class="page" data-testid="publishing-page">
    <h1>${t("network.publishing")}</h1>
    <section class="network" data-testid="network" aria-label=${t("network.network")}>
      <${Title} of="network">${t("network.title")}<//>
      <${Publications} it=${it} />
      <p data-testid="network-state" data-state=${it.state}>
        <b>${STATES[it.state]}</b> <small>${summary(it)}</small>
        ${
          contradictions.value.length > 0 &&
          html`
          ${" "}
          <em class="approximate">${t("network.two-publishers")}</em>
        `
        }
      </p>
      ${contradictions.value.map(
        ({ sender, camera }) => html`<div
        key=${`${sender.id}-${camera.camera_id}`}
        class="warning-line"
        role="alert"
        data-testid="contradiction"
      >
        ${rich("network.contradiction", {
          sender: sender.address,
          number: camera.camera_id,
          camera: camera.ours,
        })}
      </div>`,
      )}
      ${
        it.problem &&
        html`<div class="warning-line" role="alert" data-testid="network-problem">
        <b>${it.problem.what}</b> ${it.problem.fix} ${t("network.tried-again")}
      </div>`
      }
      <div class="line">
        <button
          type="button"
          data-testid="publish"
          aria-pressed=${String(it.enabled)}
          disabled=${changing.value}
          onClick=${() => void setPublishing({ enabled: !it.enabled })}
        >
          ${it.enabled ? t("network.stop-publishing") : t("network.publish")}
        </button>
        <button
          type="button"
          data-testid="listen"
          aria-pressed=${String(it.absorb || it.enabled)}
          disabled=${changing.value || it.enabled}
          title=${it.enabled ? t("network.listens-itself") : ""}
          onClick=${() => void setPublishing({ absorb: !it.absorb })}
        >
          ${it.absorb || it.enabled ? t("network.stop-listening") : t("network.listen")}
        </button>
      </div>
      ${it.state === "asking" && html`<${Asking} it=${it} />`}
      <${Way} it=${it} />
      <${BallModelSettings} models=${it.ball_models} />
      <${ProgramFiles} />
      <div class="plan-and-table">
        <${SentPlan} it=${it} error=${receivedError} />
        <${Sent} it=${it} />
      </div>
      ${
        it.passed_on &&
        isSending(it) &&
        html`<p data-testid="passed-on">
        ${t(it.passed_on.models ? "network.passed-on.models" : "network.passed-on", {
          sender: it.passed_on.address,
          source: it.passed_on.source,
        })}
        ${
          it.passed_on.cameras.length > 0 &&
          t("network.passed-on.cameras", { numbers: it.passed_on.cameras.join(", ") })
        }
      </p>`
      }
      <${Others} it=${it} />
    </section>
    <${RobotHeights} />
  </div>`;
}

/** @param {Publishing} it */
function summary(it) {
  if (it.state === "off")
    return it.absorb ? t("network.summary.listening") : t("network.summary.off");
  const count = it.cameras.filter((c) => c.published).length,
    sent = { count, total: it.cameras.length, group: it.group, port: it.port };
  if (it.broadcast)
    return it.interface
      ? t("network.summary.broadcast", { ...sent, interface: it.interface })
      : t("network.summary.broadcast-system", sent);
  return it.interface
    ? t("network.summary.sent", { ...sent, interface: it.interface })
    : t("network.summary.sent-system", sent);
}

/** Where packets go. @param {{ it: Publishing }} props */
function Way({ it }) {
  const known = it.interfaces.filter((i) => i.address !== null);
  const listed = it.interface === "" || known.some((i) => i.name === it.interface);
  return html`<div class="way">
    <label>
      ${t("network.way.interface")}
      <select
        data-testid="network-interface"
        value=${it.interface}
        onChange=${(/** @type {any} */ e) => void setPublishing({ interface: e.target.value })}
      >
        <option value="">${t("network.way.system-choice")}</option>
        ${known.map(
          (i) => html`<option key=${i.name} value=${i.name}>
          ${i.name}, ${i.address}
        </option>`,
        )}
        ${!listed && html`<option value=${it.interface}>${it.interface}</option>`}
      </select>
    </label>
    <${Entry} name="group" label=${t("network.way.group")} value=${it.group} type="text" />
    <${Entry} name="port" label=${t("network.way.port")} value=${it.port} />
    <${Entry}
      name="ttl"
      label=${t("network.way.ttl")}
      value=${it.ttl}
      title=${t("network.way.ttl.hint")}
    />
    <${Entry} name="interval_s" label=${t("network.way.interval")} value=${it.interval_s} step="any" />
    <${Entry}
      name="limit_mm"
      label=${t("network.way.limit")}
      value=${it.limit_mm}
      step="any"
      title=${t("network.way.limit.hint")}
    />
  </div>
  <${Tick} name="broadcast" on=${it.broadcast} title=${t("network.way.broadcast.hint")}>
    ${t("network.way.broadcast")}
  <//>
  <${Tick} name="pass_on" on=${it.pass_on} title=${t("network.way.pass-on.hint")}>
    ${t("network.way.pass-on")}
  <//>`;
}

/** @param {{ name: string, on: boolean, title: string, children?: unknown }} props */
const Tick = ({ name, on, title, children }) => html`<label class="tick" title=${title}>
  <input
    type="checkbox"
    data-testid=${`network-${name}`}
    checked=${on}
    disabled=${changing.value}
    onChange=${(/** @type {any} */ e) => void setPublishing({ [name]: e.target.checked })}
  />
  ${children}
</label>`;

/**
 * @param {{ name: string, label: string, value: string | number, type?: string, step?: string, title?: string }} props
 */
function Entry({ name, label, value, type = "number", step = "1", title = "" }) {
  const take = (/** @type {string} */ text) =>
    text === ""
      ? undefined
      : setPublishing({ [name]: type === "number" ? Number(text) : text.trim() });
  return html`<label title=${title}>
    ${label}
    <${Typed} type=${type} step=${step} data-testid=${`network-${name}`} value=${value} take=${take} />
  </label>`;
}

/** Whether packets go out now, and not only would. @param {Publishing} it */
const isSending = ({ state }) => state === "on-air";

/** At most, where the error itself is not known. @param {PublishedCamera} camera */
const lossAbove = ({ loss }) =>
  loss ? `≤ ${mm(Math.max(loss.worst_mm, LEAST_MM))}` : t("network.sent.not-known");

/** On the carpet, mm. @param {PublishedCamera} camera */
const receivedError = (camera) => (camera.expected ? mm(camera.expected.rms) : lossAbove(camera));

/** What is sent of each camera. @param {{ it: Publishing }} props */
function Sent({ it }) {
  if (!it.cameras.length) return html`<p class="reason">${t("network.sent.nothing")}</p>`;
  return html`<table class="sent">
    <caption>
      ${t(isSending(it) ? "network.sent.caption" : "network.sent.caption-off")}
    </caption>
    <thead>
      <tr>
        <th>${t("network.sent.camera")}</th>
        <th>${t("network.sent.number")}</th>
        <th>${t("network.sent.fit")}</th>
        <th>${t("network.sent.carpet")}</th>
        <th>${t("network.sent.hat")}</th>
        <th></th>
      </tr>
    </thead>
    <tbody>
      ${it.cameras.map(
        (c) => html`
        <tr key=${c.camera} data-testid=${`sent-${c.camera}`} data-published=${String(c.published)}>
          <th>
            ${nameOf(c.camera)}${" "}
            <small>
              ${t("network.sent.version", { version: c.version, model: modelTitle(c.model) })}
            </small>
          </th>
          <td>
            <${Typed}
              type="number"
              min="0"
              aria-label=${t("network.sent.number-of", { camera: nameOf(c.camera) })}
              data-testid=${`number-${c.camera}`}
              value=${c.camera_id}
              take=${(/** @type {string} */ text) =>
                setPublishing({ numbers: { [c.camera]: text === "" ? null : Number(text) } })}
            />
          </td>
          <td>${c.fit_expected ? mm(c.fit_expected.rms) : t("network.sent.not-known")}</td>
          <td class=${above(c.expected?.rms, it)} title=${lossOf(c)}>
            ${receivedError(c)}
          </td>
          <td class=${above(topsOf(c), it)}>${topsOf(c) === null ? t("network.sent.not-known") : mm(topsOf(c))}</td>
          <td>
            ${
              c.published
                ? html`<span class="sent-mark">${t(isSending(it) ? "network.sent.sent" : "network.sent.ready")}</span>`
                : html`<em class="approximate">${t("network.sent.left-out")}</em>`
            }
          </td>
        </tr>
        ${
          c.problem &&
          html`<tr key=${`${c.camera}-why`} class="why">
          <td colspan="6">
            ${c.problem.what} ${c.problem.fix}
            ${
              c.problem.reason === "loss-above-limit" &&
              html`
              ${" "}
              <button
                type="button"
                data-testid=${`approve-${c.camera}`}
                disabled=${changing.value}
                onClick=${() => void setPublishing({ approved: { [c.camera]: c.calibration } })}
              >
                ${t("network.sent.approve")}
              </button>
            `
            }
          </td>
        </tr>`
        }
        ${
          c.published &&
          c.warnings.map(
            (w) => html`<tr key=${`${c.camera}-${w.reason}`} class="why">
          <td colspan="6" data-testid=${`told-${c.camera}-${w.reason}`}>${w.text} ${w.fix}</td>
        </tr>`,
          )
        }
      `,
      )}
    </tbody>
  </table>`;
}

/** Who else is there. @param {{ it: Publishing }} props */
function Others({ it }) {
  const all = receivedGeometry.value;
  if (!(it.absorb || it.enabled) || !all)
    return html`<p class="reason">
      ${t("network.others.listen")}
    </p>`;
  if (all.problem)
    return html`<div class="warning-line" role="alert">
      <b>${all.problem.what}</b> ${all.problem.fix}
    </div>`;
  if (!all.items.length)
    return html`<p class="reason" data-testid="nobody">
      ${t("network.others.nobody")}
    </p>`;
  return html`<ul class="plain others">
    ${all.items.map(
      (sender) => html`<li key=${sender.id} data-testid=${`heard-${sender.id}`}>
      <b>${sender.address}</b>${" "}
      <small>
        ${t("network.others.heard", { port: sender.port, source: sender.source, age: number(sender.age_s, 0) })}
        ${sender.refused ? t("network.others.refused", { count: sender.refused }) : ""}
      </small>
      <small class="where">
        ${
          sender.field
            ? `${sender.field.known ? fieldTitle(sender.field) : t("network.others.unknown-field")}, ` +
              `${number(sender.field.length_mm, 0)} × ${number(sender.field.width_mm, 0)} mm`
            : sender.problem
              ? sender.problem.what
              : (sender.refusal ?? t("network.others.no-geometry"))
        }
      </small>
      ${sender.differs.map(
        ({ text }, i) => html`<small key=${i} class="where" data-testid=${`differs-${sender.id}`}>
        ${text}
      </small>`,
      )}
      ${sender.cameras.map(
        (camera) => html`<${Other} key=${camera.camera_id} sender=${sender} camera=${camera} />`,
      )}
    </li>`,
    )}
  </ul>`;
}

/** As the page's other places call it. @param {{ name: string, title: string }} field */
const fieldTitle = ({ name, title }) => fields.value.find((f) => f.name === name)?.title ?? title;

/** One camera of somebody else's. @param {{ sender: GeometrySender, camera: ReceivedCamera }} props */
function Other({ sender, camera }) {
  const key = `${sender.id} ${camera.camera_id}`;
  const target =
    targets.value[key] ??
    camera.ours ??
    cameras.value[camera.camera_id % Math.max(1, cameras.value.length)]?.id ??
    "";
  return html`<div class="line other">
    <span>
      ${t("network.others.camera", { number: camera.camera_id })}${" "}
      <small>
        ${
          camera.problem
            ? camera.problem.what
            : t("network.others.at", {
                place: (camera.position_mm ?? []).map((v) => number(v, 0)).join(", "),
              })
        }
      </small>
    </span>
    ${
      !camera.problem &&
      cameras.value.length > 0 &&
      html`
      <select
        aria-label=${t("network.others.keep-for")}
        value=${target}
        onChange=${(/** @type {any} */ e) => {
          targets.value = { ...targets.value, [key]: e.target.value };
        }}
      >
        ${cameras.value.map(
          (c) => html`<option key=${c.id} value=${c.id}>
          ${c.name}
        </option>`,
        )}
      </select>
      <button
        type="button"
        data-testid=${`take-over-${sender.id}-${camera.camera_id}`}
        onClick=${() => void saveReceived(sender, camera, target)}
      >
        ${t("network.others.take-over")}
      </button>
    `
    }
  </div>`;
}

/** @param {string} id */
const nameOf = (id) => cameras.value.find((c) => c.id === id)?.name ?? id;

/**
 * What is above the limit looks so, approved or not.
 * @param {number | null | undefined} value
 * @param {Publishing} it
 */
const above = (value, it) =>
  value !== null && value !== undefined && value > it.limit_mm ? "approximate" : "";

/** What teams receive at robot tops, mm; null where it is unknown or a guess. @param {PublishedCamera} camera */
const topsOf = ({ expected }) =>
  expected?.hat && expected.hat.known !== false ? expected.hat.rms : null;

/** How far the packet's camera is from the calibration. @param {PublishedCamera} camera */
const lossOf = ({ loss }) =>
  loss
    ? t("network.sent.worst-at", {
        error: mm(loss.worst_mm),
        place: loss.worst_place.map((v) => number(v, 0)).join(", "),
      })
    : "";
