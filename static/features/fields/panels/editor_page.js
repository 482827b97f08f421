// The field that is edited, drawn: its markings, what is chosen with its handles, and where the pointer is.
import { useLayoutEffect, useRef } from "preact/hooks";
import { listen } from "../../../canvas/tools/pointer.js";
import { number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { rich } from "../../../ui/rich.js";
import { arcPoints } from "../../calibrate/field_sides.js";
import { chooseNext } from "../actions.js";
import { markTitle } from "../document.js";
import { chosen, history, isShipped, opened, pointed, viewport } from "../editor.js";
import { drawingSize, fieldPoint, stageTransform } from "../frame.js";
import { includes } from "../geometry.js";
import { gripsOf } from "../grips.js";
import { editorTool } from "../tool.js";

/** @typedef {import("../types").FieldDoc} FieldDoc @typedef {import("../types").Mark} Mark */

const TOOLS = [
  "save-field",
  "copy-field",
  "|",
  "field-undo",
  "field-redo",
  "field-remove",
  "|",
  "field-zoom-out",
  "field-zoom-in",
  "field-zoom-fit",
];
const GRIP_PX = 6;

export function EditorPage() {
  const stage = useRef(/** @type {HTMLElement | null} */ (null)),
    doc = history.doc.value,
    { size, view, fit } = viewport;
  useLayoutEffect(() => {
    const element = stage.current;
    if (!element) return undefined;
    const watch = new ResizeObserver(([{ contentRect }]) => {
      size.value = { width: contentRect.width, height: contentRect.height };
      if (view.value.fitted && history.doc.value) fit(drawingSize(history.doc.value));
    });
    watch.observe(element);
    const { panBy, zoomBy, toPicture } = viewport;
    const off = listen(element, {
      pick: editorTool,
      isPicking: () => true,
      panBy,
      zoomBy,
      toPicture,
      point: (at) => {
        const now = history.doc.value;
        pointed.value = at && now && fieldPoint(now, [at.x, at.y]);
      },
    });
    return () => {
      watch.disconnect();
      off();
    };
  }, [doc === null]);
  useLayoutEffect(() => {
    if (doc && view.value.fitted) fit(drawingSize(doc));
  }, [doc?.length_mm, doc?.width_mm]);
  if (!doc)
    return html`<div class="page">
      <p class="dim">${t("field-editor.opening")}</p>
    </div>`;
  return html`<div class="field-desk" data-testid="field-editor">
    <h1 class="sr">${opened.value?.name ? doc.title : t("field-editor.untitled")}</h1>
    <div class="tools" role="toolbar" aria-label=${t("field-editor.tools")}>
      ${TOOLS.map((id, i) =>
        id === "|" ? html`<i key=${i}></i>` : html`<${ActionButton} key=${id} id=${id} withKey />`,
      )}
    </div>
    <section
      class=${`field-stage ${isShipped.value ? "pan" : "pick"}`}
      ref=${stage}
      data-testid="field-stage"
      tabindex="0"
      aria-label=${t("field-editor.stage")}
      onKeyDown=${tab}
    >
      <${Drawing} doc=${doc} />
    </section>
    <${ReadOut} doc=${doc} />
  </div>`;
}

/** Tab goes from marking to marking, and after the last one on to the next control. @param {KeyboardEvent} e */
function tab(e) {
  if (e.key === "Tab" && e.target === e.currentTarget && chooseNext(e.shiftKey ? -1 : 1))
    e.preventDefault();
}

/** @param {{ doc: FieldDoc }} props */
function Drawing({ doc }) {
  const { k } = viewport.view.value,
    x = doc.length_mm / 2,
    y = doc.width_mm / 2,
    grip = (GRIP_PX * 10) / k;
  /** @param {Mark} mark @param {boolean} [off] */
  const state = (mark, off = false) =>
    `${off ? "off" : "on"}${includes(chosen.value, mark) ? " chosen" : ""}`;
  return html`<svg class="field-drawing" aria-hidden="true">
    <g transform=${stageTransform(doc)}>
      <rect class="carpet" x=${-1.16 * x} y=${-y - 0.16 * x} width=${2.32 * x} height=${2 * y + 0.32 * x} />
      ${chosen.value
        .filter(({ kind, name }) => kind === "region" && name in doc.regions)
        .map(({ name }) => {
          const [[x0, x1], [y0, y1]] = [doc.regions[name].x, doc.regions[name].y];
          return html`<rect
            key=${name}
            class="part"
            x=${Math.min(x0, x1)}
            y=${Math.min(y0, y1)}
            width=${Math.abs(x1 - x0)}
            height=${Math.abs(y1 - y0)}
          />`;
        })}
      ${doc.lines.map(
        ({ name, from, to, off }) => html`<path
        key=${name}
        class=${state({ kind: "line", name }, off)}
        d=${`M${from.join(" ")}L${to.join(" ")}`}
      />`,
      )}
      ${doc.arcs.map(
        (arc) => html`<path
        key=${arc.name}
        class=${state({ kind: "arc", name: arc.name }, arc.off)}
        d=${`M${arcPoints(arc)
          .map((p) => p.join(" "))
          .join("L")}`}
      />`,
      )}
      ${Object.entries(doc.landmarks).map(
        ([name, [cx, cy]]) => html`<circle
        key=${name}
        class=${`spot ${state({ kind: "landmark", name })}`}
        cx=${cx}
        cy=${cy}
        r=${grip / 2.4}
      />`,
      )}
      ${
        !isShipped.value &&
        chosen.value.flatMap((mark) =>
          gripsOf(doc, mark).map(
            ({ part, at }) => html`<circle
          key=${`${mark.name} ${part}`}
          class="grip"
          data-testid=${`grip-${part}`}
          cx=${at[0]}
          cy=${at[1]}
          r=${grip}
        />`,
          ),
        )
      }
    </g>
  </svg>`;
}

/** @param {{ doc: FieldDoc }} props */
function ReadOut({ doc }) {
  const at = pointed.value,
    names = chosen.value.map(markTitle).join(", ");
  return html`<div class="read-out" data-testid="field-read-out">
    <span>
      ${
        at
          ? rich("field-editor.read-out", { x: number(at[0], 0), y: number(at[1], 0) })
          : html`<span class="dim">${number(doc.length_mm, 0)} × ${number(doc.width_mm, 0)} mm</span>`
      }
    </span>
    <span role="status">${names}</span>
  </div>`;
}
