// Every stage of the detection plan: its picture, its time, its options; and the plans to begin with.
import { number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { nameOr, t } from "../../../core/words.js";
import { Title } from "../../../ui/title.js";
import { OptionRow } from "../../calibrate/panels/options.js";
import { detectionCamera, detectionState, kinds, plans, tune } from "../detection.js";
import { toggleView, view } from "../display.js";
import { detections } from "../held_frame.js";
import { StagePicture } from "../layers/stage_picture.js";

/** @typedef {import("../types").PlanStage} PlanStage */

const SMALL_PX = 320,
  SLOW_FPS = 3;

export function StageStrip() {
  const it = detectionState.value,
    camera = detectionCamera.value;
  if (!it || !camera) return null;
  const took = Object.fromEntries((detections.value?.stages ?? []).map((s) => [s.name, s.ms])),
    total = detections.value?.ms ?? 0;
  const same =
    plans.value.find((p) => JSON.stringify(p.stages) === JSON.stringify(it.plan.stages))?.name ??
    "";
  return html`<section aria-label=${t("detection.stages.title")} data-testid="stages">
    <${Title} of="stages">${t("detection.stages.title")}<//>
    <div class="line wrap">
      <label class="line plan">
        ${t("detection.stages.plan")}${" "}
        <select
          data-testid="plan"
          value=${same}
          onChange=${(/** @type {any} */ e) => {
            const plan = plans.value.find((p) => p.name === e.target.value);
            if (plan) void tune({ plan });
          }}
        >
          ${
            !same &&
            html`<option value="">
            ${t("detection.stages.own-plan", { plan: planTitle(it.plan) })}
          </option>`
          }
          ${plans.value.map(
            (p) => html`<option key=${p.name} value=${p.name}>
            ${planTitle(p)}
          </option>`,
          )}
        </select>
      </label>
      <label
        class="line"
        title=${
          camera.active_calibration
            ? t("detection.stages.correct.cost")
            : t("live.calibration-first")
        }
      >
        <input
          type="checkbox"
          data-testid="plan-corrected"
          checked=${it.plan.corrected === true}
          disabled=${!camera.active_calibration && !it.plan.corrected}
          onChange=${(/** @type {any} */ e) =>
            void tune({ plan: { ...it.plan, corrected: e.target.checked } })}
        />${" "}
        ${t("detection.stages.correct")}
      </label>
      <small data-testid="stages-ms">
        ${t("detection.stages.time", { count: it.plan.stages.length, time: number(total, 1) })}
        ${
          detections.value?.fps
            ? t("detection.stages.rate", { rate: number(detections.value.fps, 1) })
            : ""
        }
      </small>
    </div>
    <ol class="stages">
      ${it.plan.stages.map(
        (stage, i) => html`<${Stage}
        key=${stage.stage}
        camera=${camera.id}
        stage=${stage}
        number=${i + 1}
        ms=${took[stage.stage]}
        share=${total ? (took[stage.stage] ?? 0) / total : 0}
      />`,
      )}
    </ol>
  </section>`;
}

/** A plan that comes with Touchline is named here, another by whoever made it. @param {import("../types").Plan} plan */
const planTitle = ({ name, title }) => nameOr(`detection.plan.${name}`, title);

/** @param {{ camera: string, stage: PlanStage, number: number, ms: number | undefined, share: number }} props */
function Stage({ camera, stage, number: place, ms, share }) {
  const name = stage.stage,
    kind = kinds.value.find((k) => k.name === name),
    isLarge = view.value === `stage-${name}`;
  return html`<li data-testid=${`stage-${name}`}>
    <button
      type="button"
      class="stage-picture"
      aria-pressed=${String(isLarge)}
      aria-label=${t(isLarge ? "detection.stages.shrink" : "detection.stages.enlarge", { stage: kind?.title ?? name })}
      onClick=${() => toggleView(`stage-${name}`)}
    >
      <${StagePicture} camera=${camera} stage=${name} width=${SMALL_PX} fps=${SLOW_FPS} />
    </button>
    <div class="stage-head">
      <b>
        ${place}. ${kind?.title ?? name}
      </b>
      <span data-testid=${`ms-${name}`}>${number(ms, 1)} ms</span>
    </div>
    <div class="bar" aria-hidden="true">
      <b style=${`left:0;width:${Math.round(100 * share)}%`}></b>
    </div>
    ${
      kind &&
      html`
      <p class="reason">${kind.help}</p>
      ${
        kind.options.length > 0 &&
        html`<details class="more">
        <summary data-testid=${`options-${name}`}>${t("detection.stages.settings")}</summary>
        ${kind.options.map(
          (option) => html`<${OptionRow}
          key=${option.name}
          option=${option}
          id=${`stage-${name}-${option.name}`}
          value=${stage[option.name] ?? option.default}
          set=${(/** @type {unknown} */ value) => setOption(name, option, value)}
        />`,
        )}
      </details>`
      }
    `
    }
  </li>`;
}

/**
 * @param {string} name
 * @param {import("../../../core/types").Option} option
 * @param {unknown} value null: as it is at first
 */
function setOption(name, option, value) {
  const plan = detectionState.value?.plan;
  if (!plan) return;
  const at = plan.stages.findIndex((s) => s.stage === name);
  void tune({
    plan: {
      ...plan,
      stages: plan.stages.with(at, { ...plan.stages[at], [option.name]: value ?? option.default }),
    },
  });
}
