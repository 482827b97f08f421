// The tab Drift of a camera: whether it has moved, where to and since when; the check of its calibration, and its pose
// updated.
import { html } from "../../../core/html.js";
import { addressOf } from "../../../core/route.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { rich } from "../../../ui/rich.js";
import { CheckWorking, CheckedPicture } from "../../check/panels/check.js";
import { openedCamera, status } from "../../live/camera_page.js";
import { DriftPanel } from "./drift.js";
import { DriftPicture } from "./drift_picture.js";
import { DriftTimeline } from "./drift_timeline.js";

export function DriftPage() {
  const it = openedCamera.value;
  if (!it) return null;
  return html`<div class="page" data-testid="drift-page">
    <h1>${t("drift.page.title", { camera: it.name })}</h1>
    ${
      it.active_calibration || status.value?.active_calibration
        ? html`
        <${DriftPanel} id=${it.id} />
        <div class="line wrap">
          <${ActionButton} id="check-calibration" />
          ${!status.value?.drift?.alarm && html`<${ActionButton} id="reregister" />`}
        </div>
        <${CheckWorking} />
        <${DriftPicture} key=${it.id} id=${it.id} name=${it.name} />
        <${DriftTimeline} key=${it.id} />
        <${CheckedPicture} />
      `
        : html`<p class="dim">
        ${rich("drift.page.no-version", {
          link: html`<a href=${addressOf("camera-images", { camera: it.id })}>${t("drift.page.calibrate")}</a>`,
        })}
      </p>`
    }
  </div>`;
}
