// The stage: the picture with what is drawn on it; its tools above, its legends and the read-out below.
import { useLayoutEffect, useRef, useState } from "preact/hooks";
import { address } from "../core/api.js";
import { mm, number } from "../core/format.js";
import { html } from "../core/html.js";
import { comparing, editing, pointer, snapshot, tool } from "../core/state.js";
import { t } from "../core/words.js";
import { Corrected, OnRaw, Wipe, rawClip } from "./layers/compare.js";
import { Heat } from "./layers/heat.js";
import { Hovered } from "./layers/hovered.js";
import { FloatingLoupe, loupePicture } from "./layers/loupe.js";
import { Overlay } from "./layers/overlay.js";
import { ResidualArrows } from "./layers/residual_arrows.js";
import { Toolbar } from "./toolbar.js";
import { listen } from "./tools/pointer.js";
import { fit, mainViewport, placed, stageSize, view } from "./viewport.js";
import { selectNext } from "../features/calibrate/editing.js";
import { snapMessage } from "../features/calibrate/snapping.js";
import {
  fieldUnderPointer,
  paneUnder,
  pointedAt,
  visiblePicture,
} from "../features/compare/comparison.js";
import { shownMap as heatMap, valueAt } from "../features/compare/heat.js";

/** @param {string} id */
const pictureOf = (id) => address(`/snapshots/${id}/image.png`);

/** @param {{ Legends: () => any }} props the words beside what is drawn */
export function Stage({ Legends }) {
  const stage = useRef(/** @type {HTMLElement | null} */ (null));
  const [loaded, setLoaded] = useState(""); // the address of the picture that is there
  const shown = snapshot.value;

  // Before anything is painted: a press on what is seen must not go unheard.
  useLayoutEffect(() => {
    const element = /** @type {HTMLElement} */ (stage.current);
    const watch = new ResizeObserver(([entry]) => {
      const { width, height } = entry.contentRect;
      stageSize.value = { width, height };
      if (view.value.fitted) fit(snapshot.value);
    });
    watch.observe(element);
    return () => watch.disconnect();
  }, []);
  useLayoutEffect(() => (shown && stage.current ? listen(stage.current) : undefined), [shown?.id]);

  const { k, tx, ty } = view.value;
  return html`
    ${shown && html`<${Toolbar} />`}
    <section
      class=${`stage ${shown ? (editing.value && visiblePicture.value !== "corrected" ? tool.value : "pan") : "empty"}`}
      ref=${stage}
      data-testid="stage"
      tabindex=${shown ? 0 : -1}
      aria-label=${label()}
      onKeyDown=${tab}
      onPointerMoveCapture=${inPane}
      onPointerDownCapture=${inPane}
    >
      ${
        shown &&
        html`
        <div class="half" style=${rawClip.value}>
          <img
            class="picture"
            ref=${loupePicture}
            data-testid="picture"
            alt=${t("canvas.stage.raw-picture")}
            draggable=${false}
            src=${pictureOf(shown.id)}
            onLoad=${(/** @type {Event} */ e) => setLoaded(/** @type {HTMLImageElement} */ (e.currentTarget).src)}
            style=${placed(tx, ty, k)}
          />
          <${Heat} frame="image" size=${[shown.width, shown.height]} x=${tx} y=${ty} k=${k} />
          <${ResidualArrows} frame="image" x=${tx} y=${ty} k=${k} />
          ${comparing.value ? html`<${OnRaw} />` : html`<${Overlay} />`}
          <${Hovered} />
        </div>
        ${
          (comparing.value || editing.value) &&
          html`
          <${Corrected} raw=${loaded.endsWith(pictureOf(shown.id)) ? loupePicture.current : null} />
          <${Wipe} />
        `
        }
        <${FloatingLoupe} />
      `
      }
    </section>
    ${
      shown &&
      html`
      <div class="legends">
        <${Legends} />
      </div>
      <${ReadOut} />
    `
    }
  `;
}

/** Tab goes from point to point, and after the last one on to the next control. @param {KeyboardEvent} e */
function tab(e) {
  if (e.key !== "Tab" || e.target !== e.currentTarget || !editing.value) return;
  if (selectNext(e.shiftKey ? -1 : 1, false)) e.preventDefault();
}

/** Which of two pictures the pointer is over. @param {PointerEvent} e */
function inPane(e) {
  const { left, top } = /** @type {Element} */ (e.currentTarget).getBoundingClientRect();
  paneUnder.value = mainViewport.paneAt(e.clientX - left, e.clientY - top);
}

function label() {
  if (!snapshot.value) return t("canvas.stage.empty");
  if (comparing.value) return t("canvas.stage.comparing");
  return editing.value ? t("canvas.stage.editing") : t("canvas.stage.viewing");
}

/** What is under the pointer. */
function ReadOut() {
  const map = heatMap.value,
    there = map && fieldUnderPointer.value ? valueAt(map, fieldUnderPointer.value) : null;
  const at = pointer.value,
    spot = fieldUnderPointer.value,
    on = pointedAt.value;
  const [name, [x, y]] =
    on?.from === "corrected"
      ? [t("canvas.stage.corrected-pixel"), on.point]
      : [t("canvas.stage.pixel"), [at?.x ?? 0, at?.y ?? 0]];
  return html`<div class="read-out" data-testid="read-out">
    <span>
      ${
        at
          ? html`
          ${name}${" "}
          <b>
            ${number(x)}, ${number(y)}
          </b>
        `
          : html`<span class="dim">${t("canvas.stage.no-position")}</span>`
      }
    </span>
    ${
      on &&
      html`<span>
      ${t("canvas.stage.field")}${" "}
      <b>${spot ? `${number(spot[0], 0)}, ${number(spot[1], 0)} mm` : t("canvas.stage.out-of-reach")}</b>
    </span>`
    }
    ${
      on &&
      map &&
      html`<span>
      ${map.what === "expected" ? t("canvas.stage.expected-error") : t("canvas.stage.difference")}${" "}
      <b>${there === null ? "–" : `${mm(there)} mm`}</b>
    </span>`
    }
    ${
      editing.value &&
      html`<span role="status" data-testid="snap-said">
      ${snapMessage.value}
    </span>`
    }
    <span class="zoom">${number(view.value.k * 100, 0)} %</span>
  </div>`;
}
