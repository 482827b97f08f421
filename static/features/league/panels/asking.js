// Another program publishes already: who decides, publishes both, stays silent, or gives the other program a file.
import { address } from "../../../core/api.js";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import {
  changing,
  confirmPublishing,
  ofShownRig,
  receivedGeometry,
  setPublishing,
} from "../network.js";

const senders = () =>
  (receivedGeometry.value?.items ?? []).filter((sender) => sender.geometry_age_s !== null);

/** @param {{ it: import("../types").Publishing }} props */
export const Asking = ({ it }) => html`<div class="warning-line" role="alert" data-testid="asking">
  <b>${t("network.asking")}</b> ${t("network.asking.advice")}
  <ul>
    ${senders().map(
      (sender) => html`<li key=${sender.id}>
      ${t("network.asking.sender", { address: sender.address, port: sender.port, source: sender.source })}${" "}
      ${sender.differs.map(({ text }) => text).join(" ")}
    </li>`,
    )}
  </ul>
  <div class="line wrap">
    <button
      type="button"
      data-testid="publish-both"
      disabled=${changing.value}
      onClick=${() => void confirmPublishing()}
    >
      ${t(it.passed_on ? "network.asking.both-as-theirs" : "network.asking.both")}
    </button>
    <button
      type="button"
      data-testid="stay-silent"
      disabled=${changing.value}
      onClick=${() => void setPublishing({ enabled: false })}
    >
      ${t("network.asking.silent")}
    </button>
    <a
      data-testid="geometry-file"
      href=${address(ofShownRig("/publishing/geometry.yml"))} 
      download="touchline.geometry.yml"
    >
      ${t("network.asking.file")}
    </a>
  </div>
</div>`;
