// Whether the camera has moved: a sentence, an alarm with its one button, and the result of re-registration.
import { clock, mm, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf } from "../../../core/route.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Title } from "../../../ui/title.js";
import { Working } from "../../../ui/working.js";
import {
  closeRegistered,
  notRegistered,
  registered,
  registering,
  useRegistered,
} from "../drift.js";
import { statuses } from "../../live/camera_status.js";

const QUIET = new Set(["steady", "learning"]);
const HELD = {
  calibration: t("drift.held.calibration"),
  start: t("drift.held.start"),
};

/** On the desk of one camera. @param {{ id: string }} props */
export function DriftPanel({ id }) {
  const now = statuses.value[id],
    it = now?.drift;
  if (!now?.calibration_applied || now.state !== "live") return null;
  return html`<section aria-label=${t("drift.title")} data-testid="drift" data-state=${it?.state ?? ""}>
    <${Title} of="drift">${t("drift.title")}<//>
    ${
      !it
        ? html`<p class="reason">${t("drift.asking")}</p>`
        : it.alarm
          ? html`<div class="warning-line" role="alert" data-testid="drift-alarm">
        <b>${it.sentence}</b> ${it.fix}
        <p class="reason">${t("drift.since", { time: clock(1000 * it.since) })}</p>
        <div class="line">
          <${ActionButton} id=${it.state === "knocked" ? "reregister" : "take-still"} />
        </div>
      </div>`
          : QUIET.has(it.state)
            ? html`<p data-testid="drift-words">
        <b>${it.sentence}</b> ${it.doubt}
      </p>`
            : html`<div class="warning-line" role="status" data-testid="drift-words">
        <b>${it.sentence}</b> ${it.fix}
      </div>`
    }
    <${Working}
      now=${registering.value}
      what=${t("drift.registering")}
      stop="stop-reregister"
      why=${notRegistered.value}
      name="reregister"
    />
    <${RegisteredVersion} />
    ${
      it?.px !== null &&
      it?.px !== undefined &&
      html`<dl class="details">
      <div>
        <dt>${t("drift.noise")}</dt>
        <dd>
          ${number(it.sigma_px, 3)} px, ${number(it.sigma_mm, 2)} mm
        </dd>
      </div>
      <div>
        <dt>${t("drift.places-seen")}</dt>
        <dd>${it.seen}</dd>
      </div>
    </dl>`
    }
    ${it?.reference && html`<p class="reason">${HELD[it.reference]}</p>`}
  </section>`;
}

/** What the button made: to look at, and to use. */
function RegisteredVersion() {
  const it = registered.value;
  if (!it) return null;
  return html`<div class="registered" role="status" data-testid="registered">
    <p>
      <b>${t("drift.registered", { version: it.made.version })}</b> ${it.made.sentence}
    </p>
    ${
      it.apart &&
      html`<p class="reason">
      ${t("drift.registered.apart", { median: mm(it.apart.median_mm), worst: mm(it.apart.max_mm) })}
    </p>`
    }
    <div class="line wrap">
      <button type="button" data-testid="use-registered" onClick=${() => void useRegistered()}>
        ${t("common.activate-version", { version: it.made.version })}
      </button>
      <a data-testid="look-at-registered" href=${addressOf("calibrate", { picture: it.made.snapshot, step: "verify" })}>
        ${t("drift.registered.look")}
      </a>
      <a data-testid="compare-registered" href=${addressOf("versions", { camera: it.camera })}>
        ${t("drift.registered.compare")}
      </a>
      <button type="button" data-testid="close-registered" onClick=${closeRegistered}>
        ${t("drift.registered.leave")}
      </button>
    </div>
  </div>`;
}
