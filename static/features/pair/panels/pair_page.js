// Two pictures beside each other, each with its marks and epipolar lines; and the choice of a picture where one is
// missing.
import { useLayoutEffect, useRef } from "preact/hooks";
import { ACTIONS, run } from "../../../core/actions.js";
import { address, thumbnail } from "../../../core/api.js";
import { dayAndTime, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { busy, cameras, snapshots, tool } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { SIZE_PX } from "../../../canvas/layers/loupe.js";
import { listen } from "../../../canvas/tools/pointer.js";
import { placed } from "../../../canvas/viewport.js";
import { MatchGlass, PairOverlay } from "../layers/pair_overlay.js";
import { matchTool } from "../match_tool.js";
import {
  both,
  filesFor,
  pair,
  pictures,
  pointed,
  setPicture,
  side,
  sideName,
  takeFor,
  views,
} from "../pair.js";

/** @typedef {import("../types").Side} Side */

const KEYS = t("pair.keys");
const TOOLS = [
  "pick",
  "pan",
  "|",
  "undo",
  "redo",
  "delete",
  "|",
  "zoom-out",
  "zoom-in",
  "zoom-fit",
  "|",
  "pair-lines",
];
const RECENT = 8;

export function PairPage() {
  return html`<div class="pair-desk" data-testid="pair-desk">
    <h1 class="sr">${t("pair.title")}</h1>
    <div class="tools" role="toolbar" aria-label=${t("pair.tools")}>
      ${TOOLS.map((id, i) =>
        id === "|" ? html`<i key=${i}></i>` : html`<${ActionButton} key=${id} id=${id} withKey />`,
      )}
    </div>
    <div class="halves">
      <${Half} s="a" key="a" />
      <${Half} s="b" key="b" />
    </div>
  </div>`;
}

/** @param {{ s: Side }} props */
function Half({ s }) {
  const element = useRef(/** @type {HTMLElement | null} */ (null)),
    picture = useRef(/** @type {HTMLImageElement | null} */ (null));
  const it = pictures.value[s],
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
      pick: matchTool(s, () => both.value),
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
    // before the next key: after a click by key it is the other picture's turn
    if (
      side.value === s &&
      element.current?.parentElement?.contains(document.activeElement) &&
      document.activeElement !== element.current
    )
      element.current.focus({ preventScroll: true });
  }, [side.value]);
  const { k, tx, ty } = view.value;
  return html`<div
    class=${`pair-half ${it ? (both.value ? tool.value : "pan") : "empty"}`}
    ref=${element}
    data-testid=${`half-${s}`}
    data-side=${s}
    data-now=${side.value === s}
    tabindex=${it ? 0 : -1}
    role="group"
    aria-label=${`${t(`pair.half.${s}`)} ${it ? KEYS : ""}`}
    onFocus=${() => {
      side.value = s;
    }}
    onDropCapture=${() => {
      filesFor.side = s;
    }}
  >
    ${!it
      ? html`<${Choice} s=${s} />`
      : html`
        <div class="half">
          <img
            class="picture"
            ref=${picture}
            data-testid=${`picture-${s}`}
            alt=${t(`pair.picture.title.${s}`)}
            draggable=${false}
            src=${address(`/snapshots/${it.id}/image.png`)}
            style=${placed(tx, ty, k)}
          />
          <${PairOverlay} s=${s} />
        </div>
        ${size.value.width > SIZE_PX + 60 && html`<${MatchGlass} s=${s} picture=${picture} />`}
        <${ReadOut} s=${s} />
      `}
  </div>`;
}

/** What is under the pointer, and how many matches there are. @param {{ s: Side }} props */
function ReadOut({ s }) {
  const at = pointed.value?.side === s ? pointed.value : null;
  return html`<div class="read-out" data-off-stage data-testid=${`read-out-${s}`}>
    <span>
      ${at
        ? html`<b>
          ${number(at.x)}, ${number(at.y)}
        </b>`
        : (
        sideName(s)
      )}
    </span>
    <span class="zoom">${number(views[s].view.value.k * 100, 0)} %</span>
  </div>`;
}

/** A picture for this side: from a camera, a file, or one that is kept. @param {{ s: Side }} props */
function Choice({ s }) {
  return html`<section class="choice" aria-label=${t(`pair.choice.${s}`)} data-testid=${`choice-${s}`}>
    <h2>${t(`pair.picture.title.${s}`)}</h2>
    <div class="line">
      ${cameras.value.map(({ id, name: camera }) => html`<button
        key=${id}
        type="button"
        data-testid=${`take-${s}-${id}`}
        disabled=${busy.value !== ""}
        onClick=${() => void takeFor(s, id)}
      >
        ${t("pair.choice.take", { camera })}
      </button>`)}
    </div>
    <button
      type="button"
      class="drop"
      data-testid=${`open-${s}`}
      disabled=${busy.value !== ""}
      onClick=${() => {
        filesFor.side = s;
        run("open");
      }}
    >
      <b>${busy.value || ACTIONS.get("open")?.label}</b>
      <small>${t("pair.choice.or-drop")}</small>
    </button>
    ${snapshots.value.length > 0 && html`
      <h2>${t("pair.choice.latest")}</h2>
      <ul class="recent">
        ${snapshots.value.slice(0, RECENT).map((p) => html`<li key=${p.id}>
          <button
            type="button"
            data-testid=${`choose-${s}-${p.id}`}
            disabled=${pictures.value[s === "a" ? "b" : "a"]?.id === p.id}
            onClick=${() => setPicture(s, p)}
          >
            <span class="sr">${t(`pair.choice.use.${s}`)}${" "}</span>
            <img loading="lazy" alt="" src=${thumbnail(p.id)} />
            <small>
              ${cameras.value.find((c) => c.id === p.camera)?.name ?? t("pair.choice.from-file")}
              <br />
              ${dayAndTime(p.taken_at)}
            </small>
          </button>
        </li>`)}
      </ul>
    `}
    ${pair.doc.value.matches.length > 0 && 
      html`<p class="reason">${t("pair.choice.kept")}</p>`}
  </section>`;
}
