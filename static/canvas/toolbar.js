// The tools above the picture: buttons of actions, nothing else.
import { html } from "../core/html.js";
import { comparing, editing } from "../core/state.js";
import { t } from "../core/words.js";
import { isOurs } from "./graphics.js";
import { ActionButton } from "../ui/action_button.js";

const EDIT = [
  "pick",
  "pan",
  "snap",
  "|",
  "undo",
  "redo",
  "delete",
  "|",
  "zoom-out",
  "zoom-in",
  "zoom-fit",
  "lines",
  "heat",
  "arrows",
];
const CORRECTED = ["|", "corrected", "side"];
const COMPARE = [
  "raw",
  "wipe",
  "corrected",
  "side",
  "blink",
  "|",
  "lines",
  "grid",
  "heat",
  "arrows",
  "|",
  "zoom-out",
  "zoom-in",
  "zoom-fit",
];
const LOOK = ["zoom-out", "zoom-in", "zoom-fit"];

export function Toolbar() {
  const ids = comparing.value
    ? COMPARE
    : editing.value
      ? [...EDIT, ...(isOurs.value ? CORRECTED : [])]
      : LOOK;
  return html`<div
    class=${`tools${comparing.value ? " comparing" : ""}`}
    role="toolbar"
    aria-label=${t("canvas.toolbar.name")}
  >
    ${ids.map((id, i) => (id === "|" ? html`<i key=${i}></i>` : html`<${ActionButton} key=${id} id=${id} withKey />`))}
  </div>`;
}
