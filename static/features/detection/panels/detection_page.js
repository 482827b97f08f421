// Live detection: ball and robots marked in the picture, and every stage's own picture below.
import { useEffect, useRef } from "preact/hooks";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { rich } from "../../../ui/rich.js";
import { colour, colourName } from "../colours.js";
import { detectionCamera, detectionState, refusal, shownFrame, shownSeq } from "../detection.js";
import { labels, setView, view, zoom } from "../display.js";
import { fieldPositions } from "../field_positions.js";
import { detections, framePicture, heldFrame, heldFrameRefusal, taking } from "../held_frame.js";
import { ColourPicking } from "../layers/colour_picking.js";
import { DetectionMarks } from "../layers/detection_marks.js";
import { StagePicture } from "../layers/stage_picture.js";
import { LiveView } from "../../live/layers/live_view.js";
import { ClipBar } from "./clips.js";
import { Palette } from "./colours.js";
import { StageStrip } from "./stages.js";

const LETTERS_PX = 11.5,
  USUAL_PX = 680; // of the screen: letters beside the marks; how wide the picture is before it is known
const WIDTH_PX = 1280,
  MARGIN = 0.06; // of the corrected picture, as the stream draws it around the field

/** @param {number} seq */
const show = (seq) => {
  shownSeq.value = seq;
};

export function DetectionPage() {
  const camera = detectionCamera.value,
    it = detectionState.value,
    why = heldFrame.value ? heldFrameRefusal.value : refusal.value;
  if (!camera) return null;
  return html`<div class="page seeing" data-testid="seeing-page">
    <h1>${t("detection.title", { camera: camera.name })}</h1>
    <div class="line wrap">
      <div class="switch" role="group" aria-label=${t("live.show")}>
        <button
          type="button"
          data-testid="see-raw"
          aria-pressed=${String(view.value === "raw")}
          onClick=${() => setView("raw")}
        >
          ${t("common.raw")}
        </button>
        <${ActionButton} id="seen-corrected" />
        <${ActionButton} id="mask" />
      </div>
      <${ActionButton} id="seen-labels" />
      <${ActionButton} id="undo-seeing" />
      <${ActionButton} id="redo-seeing" />
      <${ActionButton} id="seen-farther" />
      <${ActionButton} id="seen-nearer" />
      <${ActionButton} id="seen-whole" />
    </div>
    <${Picture} />
    <${Palette} />
    <${ClipBar} />
    <p class="hint-line" role="status" data-testid="seeing-hint">
      ${
        why
          ? html`
          <b>${why.detail}</b> ${why.fix}
        `
          : taking.value
            ? t("detection.hint.taking")
            : colour.value
              ? html`
          ${rich("detection.hint.click", { colour: colourName(colour.value) })}
          ${heldFrame.value ? "" : ` ${t("detection.hint.click-held")}`}
        `
              : heldFrame.value
                ? t("detection.hint.held")
                : ""
      }
    </p>
    ${it && html`<${StageStrip} />`}
  </div>`;
}

/** The picture, what is seen in it, and what is clicked. */
function Picture() {
  const camera = /** @type {import("../../../core/types").Camera} */ (detectionCamera.value),
    held = heldFrame.value,
    now = detections.value,
    name = view.value,
    near = zoom.value;
  const frame = useRef(/** @type {HTMLElement | null} */ (null)),
    before = useRef(1);
  useEffect(() => {
    // what was in the middle stays there
    const box = frame.current,
      k = near / before.current;
    before.current = near;
    if (box && k !== 1) {
      box.scrollLeft = (box.scrollLeft + box.clientWidth / 2) * k - box.clientWidth / 2;
      box.scrollTop = (box.scrollTop + box.clientHeight / 2) * k - box.clientHeight / 2;
    }
  }, [near]);
  const isCorrected = name === "corrected" && !held,
    stage = name.startsWith("stage-") ? name.slice(6) : "";
  // a stage's own picture, in which raw places mean nothing
  const isStraight = stage !== "" && detectionState.value?.plan.corrected === true;
  const width = held?.width ?? now?.width ?? 4,
    height = held?.height ?? now?.height ?? 3,
    size = isCorrected ? fieldPositions.value?.corrected : null,
    margin = size ? Math.round(MARGIN * size[0]) : 0;
  const across = size ? size[0] + 2 * margin : width;
  const box = size
    ? `${-margin - 0.5} ${-margin - 0.5} ${across} ${size[1] + 2 * margin}`
    : `-0.5 -0.5 ${width} ${height}`;
  return html`<div
    class="captured sighted"
    ref=${frame}
    data-view=${name}
    data-held=${String(held !== null)}
    data-count=${now?.items.length ?? ""}
  >
    <div class="zoomed" style=${`width:${100 * near}%`}>
      ${
        stage
          ? html`<${StagePicture}
          key=${`${camera.id} ${stage}`}
          camera=${camera.id}
          stage=${stage}
          width=${WIDTH_PX}
          drawn=${show}
        />`
          : held
            ? html`<img
          class="held"
          data-testid="held-frame"
          alt=${t("detection.held-frame", { camera: camera.name })}
          width=${held.width}
          height=${held.height}
          src=${framePicture(held)}
        />`
            : html`<${LiveView}
          key=${camera.id}
          id=${camera.id}
          name=${camera.name}
          view=${isCorrected ? "corrected" : "raw"}
          width=${WIDTH_PX}
          drawn=${show}
        />`
      }
      ${
        now &&
        !isStraight &&
        html`<svg class="over" viewBox=${box} aria-hidden="true">
        <${DetectionMarks}
          items=${(held ? now : (shownFrame.value ?? now)).items}
          corrected=${isCorrected}
          size=${(LETTERS_PX * across) / near / (frame.current?.clientWidth || USUAL_PX)}
          labels=${labels.value}
        />
      </svg>`
      }
      ${
        colour.value &&
        !isCorrected &&
        !isStraight &&
        (held || now) &&
        html`<${ColourPicking} key=${`${width}×${height}`} width=${width} height=${height} />`
      }
    </div>
  </div>`;
}
