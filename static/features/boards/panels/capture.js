// A board before a live camera: its corners over the live picture, what is covered, the view that is wanted next.
import { thumbnail } from "../../../core/api.js";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { path } from "../../../canvas/drawing.js";
import { removePicture } from "../board.js";
import { automatic, boardView, captureCamera, refusal, views } from "../capture.js";
import { LiveView } from "../../live/layers/live_view.js";
import { BoardForm } from "./board.js";

const WIDTH_PX = 960;

export function CapturePage() {
  const camera = captureCamera.value;
  if (!camera) return null;
  const it = boardView.value,
    all = views.value;
  return html`<div class="page" data-testid="capture-page">
    <h1>${t("board.capture.title", { camera: camera.name })}</h1>
    <p class="dim">
      ${t("board.capture.how")}
    </p>
    <div class="line wrap">
      <${ActionButton}
        id="capture"
        withKey
        label=${automatic.value ? t("board.capture.stop-automatic") : t("board.capture.start-automatic")}
      />
      <${ActionButton} id="take-view" />
      <${ActionButton} id="find-captured" label=${t("board.find-lens")} />
    </div>
    <div class="captured" data-state=${!it ? "" : it.quad ? (it.still && it.new ? "good" : "seen") : "none"}>
      <${LiveView} key=${camera.id} id=${camera.id} name=${camera.name} width=${WIDTH_PX} />
      ${
        it &&
        html`<svg class="over" viewBox=${`-0.5 -0.5 ${it.width} ${it.height}`} aria-hidden="true">
        ${
          it.wanted &&
          html`<g class="wanted">
          <polygon points=${it.wanted.outline.join(" ")} />
        </g>`
        }
        ${it.quad && html`<path class="outline" d=${`${path(it.quad)}Z`} />`}
        ${it.corners.map(([x, y], i) => html`<circle key=${i} cx=${x} cy=${y} r=${it.width / 200} />`)}
      </svg>`
      }
    </div>
    <p class="hint-line" role="status" data-testid="capture-hint">
      ${
        refusal.value
          ? html`
          <b>${refusal.value.detail}</b> ${refusal.value.fix}
        `
          : !it
            ? t("lens-pictures.waiting-for-camera")
            : it.taken
              ? html`<b class="level good">${t("board.capture.taken")}</b>`
              : !automatic.value && it.quad
                ? t("board.capture.press-space")
                : it.hint || t("board.capture.taking")
      }
    </p>
    <section aria-label=${t("board.capture.views")}>
      <h2>${t("board.capture.views-taken", { count: all.length })}</h2>
      <ul class="views" data-testid="captured-views">
        ${all.map(
          (p) => html`<li key=${p.key} data-testid="captured-view">
          <img loading="lazy" alt="" src=${thumbnail(p.id)} />
          <button
            type="button"
            class="remove"
            aria-label=${t("lens-pictures.remove", { name: p.name })}
            title=${t("board.capture.remove-view")}
            onClick=${() => removePicture(p.key)}
          >
            ×
          </button>
          <small class="name">${p.name}</small>
        </li>`,
        )}
      </ul>
    </section>
  </div>`;
}

/** On the left: which board. */
export const CaptureForm = () => html`<${BoardForm} />`;

/** On the right: what is covered, and what is wanted. */
export function CaptureReport() {
  const it = boardView.value;
  if (!it)
    return html`<section>
      <h2>${t("board.coverage.title")}</h2>
      <p class="reason">${t("board.coverage.not-yet")}</p>
    </section>`;
  const columns = it.cells[0].length,
    most = Math.max(...it.cells.flat(), 1);
  return html`<section aria-label=${t("board.coverage.title")}>
    <h2>${t("board.coverage.share", { share: Math.round(100 * it.share) })}</h2>
    <svg
      class="coverage"
      data-testid="capture-coverage"
      viewBox=${`0 0 ${columns} ${it.cells.length}`}
      role="img"
      aria-label=${t("board.coverage.corners-in", { share: Math.round(100 * it.share) })}
    >
      ${it.cells.flatMap((row, y) =>
        row.map(
          (count, x) => html`<rect
          key=${`${x},${y}`}
          x=${x + 0.04}
          y=${y + 0.04}
          width=".92"
          height=".92"
          rx=".08"
          class=${count ? "" : "none"}
          style=${`opacity:${count ? 0.25 + 0.75 * Math.sqrt(count / most) : 1}`}
        />`,
        ),
      )}
    </svg>
    <dl class="details">
      ${Object.entries(it.tilts).map(
        ([how, count]) => html`<div key=${how}>
        <dt>
          ${
            how === "face on"
              ? t("board.coverage.facing")
              : t("board.coverage.edge-nearer", { edge: `${how[0].toUpperCase()}${how.slice(1)}` })
          }
        </dt>
        <dd>${t("common.views", { count })}</dd>
      </div>`,
      )}
    </dl>
  </section>`;
}
