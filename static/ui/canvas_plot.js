// Colours of the page for what is drawn on a canvas, and the plots there.
import { html } from "../core/html.js";
import { later } from "./later.js";

/** @type {HTMLElement | undefined} */ let probe;

/** A colour of the page as it is now, for a canvas. @param {string} name */
export function ink(name) {
  if (!probe?.isConnected) {
    probe = document.createElement("i");
    probe.hidden = true;
    document.body.append(probe);
  }
  probe.style.color = `var(${name})`;
  return getComputedStyle(probe).color; // the property itself may be a rule that a canvas does not know
}

/** A plot as ui/plot.js has it; as high before it is there. */
export const Plot = later(
  () => import("./plot.js").then((it) => it.Plot),
  ({ height }) => html`<div style=${`height:${height}px`}></div>`,
);
