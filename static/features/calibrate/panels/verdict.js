// The verdict on the present points: a length first, a sentence second, details third; every warning with its fix.
import { doc } from "../../../core/document.js";
import { mm, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { editing, snapshot } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { Title } from "../../../ui/title.js";
import { askedHeight, robotTopsMm } from "../camera_height.js";
import { preview, refusal, stale } from "../fitting.js";
import { Distortion } from "./distortion.js";
import { LEVEL } from "./levels.js";
import { LensModel } from "./model.js";
import { OptionField } from "./options.js";
import { Residuals } from "./residuals.js";
import { Fixes, Warnings } from "./warnings.js";

export function Verdict() {
  const it = preview.value?.report,
    why = refusal.value;
  return html`<section aria-label=${t("common.verdict")}>
    <${Title} of="verdict">${t("common.verdict")}<//>
    <div
      class=${`verdict${stale.value ? " stale" : ""}`}
      data-testid="verdict"
      data-level=${it?.verdict.level ?? ""}
      aria-live="polite"
    >
      ${
        it
          ? html`
          <div class="big">
            ${
              it.verdict.level === "unknown"
                ? "?"
                : html`
                ${mm(it.verdict.mm)}
                <small>
                  ${" "}
                  ${
                    it.sigma_mm && it.verdict.mm === it.sigma_mm.rms
                      ? t("calibrate.verdict.expected-error")
                      : t("calibrate.verdict.inside-field")
                  }
                </small>
              `
            }
          </div>
          <p>
            <b class=${`level ${it.verdict.level}`}>${LEVEL[it.verdict.level]}.</b> ${it.verdict.sentence}
          </p>
          <dl>
            ${
              it.sigma_mm
                ? html`
                <div>
                  <dd>${mm(it.sigma_mm.rms)} mm</dd>
                  <dt>${t("calibrate.verdict.carpet")}</dt>
                </div>
                ${
                  it.sigma_mm.hat &&
                  html`<div>
                  <dd data-testid="robot-tops">
                    ${robotTopsMm(it) === null ? "?" : `${mm(robotTopsMm(it))} mm`}
                  </dd>
                  <dt>${t("calibrate.verdict.robot-tops", { height: it.sigma_mm.hat.z_mm })}</dt>
                </div>`
                }
              `
                : html`
                <div>
                  <dd>${mm(it.rms_mm)} mm</dd>
                  <dt>${t("calibrate.verdict.borders")}</dt>
                </div>
                <div>
                  <dd>${mm(it.max_mm)} mm</dd>
                  <dt>${t("calibrate.verdict.worst-click")}</dt>
                </div>
              `
            }
            <div>
              <dd data-testid="rms-px">${number(it.rms_px, 2)} px</dd>
              <dt>${t("calibrate.verdict.residual")}</dt>
            </div>
          </dl>
        `
          : why
            ? html`
          <div class="big dim">
            – <small>mm</small>
          </div>
          <p data-testid="missing">
            <b>${why.detail}</b> ${why.fix}
          </p>
          <${Fixes} trouble=${why} />
        `
            : html`
          <div class="big dim">
            – <small>mm</small>
          </div>
          <p>
            ${t(
              stale.value
                ? "shell.sentence.computing"
                : snapshot.value
                  ? "calibrate.verdict.click-borders"
                  : "calibrate.verdict.open-picture",
            )}
          </p>
        `
      }
    </div>
    ${
      askedHeight.value &&
      html`<div class="question" data-testid="camera-height">
      <h3>${t("calibrate.verdict.camera-height")}</h3>
      <${OptionField} option=${askedHeight.value} />
    </div>`
    }
    ${it && html`<${Warnings} warnings=${it.warnings} canFix=${true} />`}
  </section>`;
}

/**
 * What else is known of a fit, a line each until it is asked for.
 * @param {{ report?: import("../../../core/types").Report }} props a saved version's report, else the present one
 */
export const Details = ({ report }) => html`
  ${editing.value && html`<${LensModel} />`}
  <${Distortion} report=${report} />
  ${(report || doc.value.observations.length > 0) && html`<${Residuals} report=${report} />`}
`;
