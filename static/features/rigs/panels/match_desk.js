// The desk of matched points: two images, each with its marks and epipolar lines.
import { useLayoutEffect, useRef } from "preact/hooks";
import { address } from "../../../core/api.js";
import { number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { tool } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { SIZE_PX } from "../../../canvas/layers/loupe.js";
import { listen } from "../../../canvas/tools/pointer.js";
import { placed } from "../../../canvas/viewport.js";
import { MatchGlass, MatchOverlay } from "../layers/match_overlay.js";
import { SIDES, both, members, pictures, pointed, side, views } from "../match_desk.js";
import { matchTool } from "../match_tool.js";

/** @typedef {import("../types").Side} Side */

const TOOLS = [
  ["pick", "pan"],
  ["undo", "redo", "delete"],
  ["zoom-out", "zoom-in", "zoom-fit"],
  ["worst-match"],
];

export const MatchDesk = () => html`<div class="match-desk" data-testid="match-desk">
  <h1 class="sr">${t("rig.match.title")}</h1>
  <div class="tools" role="toolbar" aria-label=${t("rig.match.tools")}>
    ${TOOLS.map(
      (ids, i) => html`
      ${i > 0 && html`<i></i>`}
      ${ids.map((id) => html`<${ActionButton} key=${id} id=${id} withKey />`)}
    `,
    )}
  </div>
  <div class="halves">
    ${SIDES.map((s) => html`<${Half} key=${s} s=${s} />`)}
  </div>
</div>`;

/** @param {{ s: Side }} props */
function Half({ s }) {
  const element = useRef(/** @type {HTMLElement | null} */ (null)),
    picture = useRef(/** @type {HTMLImageElement | null} */ (null));
  const it = pictures.value[s],
    title = members.value?.[s].title ?? "",
    { size, view, fit } = views[s];
  useLayoutEffect(() => {
    // at once: whoever is quick clicks before the next frame
    const half = /** @type {HTMLElement} */ (element.current);
    const measure = () => {
      const { width, height } = half.getBoundingClientRect();
      size.value = { width, height };
      if (view.value.fitted) fit(pictures.value[s]);
    };
    const watch = new ResizeObserver(measure);
    watch.observe(half);
    measure();
    return () => watch.disconnect();
  }, []);
  useLayoutEffect(() => {
    if (!it || !element.current) return undefined;
    const { panBy, zoomBy, toPicture } = views[s];
    return listen(element.current, {
      pick: matchTool(s),
      isPicking: () => tool.value !== "pan",
      panBy,
      zoomBy,
      toPicture,
      point: (at) => {
        pointed.value = at && { side: s, ...at };
      },
    });
  }, [it?.id]);
  useLayoutEffect(() => {
    // before the next key: after a click by key it is the other image's turn
    if (
      side.value === s &&
      element.current?.parentElement?.contains(document.activeElement) &&
      document.activeElement !== element.current
    )
      element.current.focus({ preventScroll: true });
  }, [side.value]);
  const { k, tx, ty } = view.value;
  return html`<div
    class=${`match-half ${both.value ? tool.value : "pan"}`}
    ref=${element}
    data-testid=${`half-${s}`}
    data-now=${both.value && side.value === s}
    tabindex=${it ? 0 : -1}
    role="group"
    aria-label=${it ? t("rig.match.half", { camera: title }) : title}
    onFocus=${() => {
      side.value = s;
    }}
  >
    ${
      it &&
      html`
      <div class="half">
        <img
          class="picture"
          ref=${picture}
          data-testid=${`picture-${s}`}
          alt=${t("rig.match.picture", { camera: title })}
          draggable=${false}
          src=${address(`/snapshots/${it.id}/image.png`)}
          style=${placed(tx, ty, k)}
        />
        <${MatchOverlay} s=${s} />
      </div>
      ${size.value.width > SIZE_PX + 60 && html`<${MatchGlass} s=${s} picture=${picture} />`}
    `
    }
    <${ReadOut} s=${s} title=${title} />
  </div>`;
}

/** Which camera it is, and what is under the pointer. @param {{ s: Side, title: string }} props */
function ReadOut({ s, title }) {
  const at = pointed.value?.side === s ? pointed.value : null;
  return html`<div class="read-out" data-off-stage data-testid=${`read-out-${s}`}>
    <b>${title}</b>
    ${at && html`<span>${number(at.x)}, ${number(at.y)}</span>`}
    <span class="zoom">${number(views[s].view.value.k * 100, 0)} %</span>
  </div>`;
}
