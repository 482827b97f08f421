// The tools above the picture: buttons of actions, nothing else.
import { ACTIONS, run } from "../features/shell/action_table.js";
import { html } from "../core/html.js";
import { printed } from "../core/keys.js";
import { comparing, step } from "../core/state.js";

const EDIT = ["pick", "pan", "snap", "|", "undo", "redo", "delete", "|", "zoom-out", "zoom-in", "zoom-fit", "lines", "heat", "arrows"];
const COMPARE = ["raw", "wipe", "corrected", "side", "blink", "|", "lines", "grid", "heat", "arrows", "|", "zoom-out", "zoom-in", "zoom-fit"];
const LOOK = ["zoom-out", "zoom-in", "zoom-fit"];

export function Toolbar() {
  const ids = comparing.value ? COMPARE : step.value === "borders" || step.value === "model" ? EDIT : LOOK;
  return html`<div class=${`tools${comparing.value ? " comparing" : ""}`} role="toolbar" aria-label="Tools" data-off-stage>
    ${ids.map((id, i) => (id === "|" ? html`<i key=${i}></i>` : html`<${ActionButton} key=${id} id=${id} withKey/>`))}
  </div>`;
}

/** A button for one action. @param {{ id: string, label?: string, withKey?: boolean, kind?: string }} props */
export function ActionButton({ id, label, withKey = false, kind = "" }) {
  const action = ACTIONS.get(id);
  if (!action) throw new Error(`No action is called ${id}.`);
  const key = action.keys?.[0], shown = label ?? action.short ?? action.label;
  return html`<button type="button" class=${kind} data-testid=${`do-${id}`} disabled=${!(action.enabled?.() ?? true)}
      aria-pressed=${action.pressed ? String(action.pressed()) : undefined} aria-label=${action.label.toLowerCase().includes(shown.toLowerCase()) || !/\w/.test(shown) ? action.label : `${shown}: ${action.label}`}
      aria-keyshortcuts=${key?.replace("ctrl", "Control").replace("shift", "Shift")} title=${key ? `${action.label} (${printed(key)})` : action.label} onClick=${() => run(id)}>
    ${shown}${withKey && key && key.length === 1 && key >= "a" ? html` <kbd aria-hidden="true" data-key=${printed(key)}></kbd>` : ""}
  </button>`;
}
