// A button for one action of the table.
import { ACTIONS, run } from "../core/actions.js";
import { html } from "../core/html.js";
import { keyLabel, keyOf } from "../core/keys.js";

/** A button for one action. @param {{ id: string, label?: string, withKey?: boolean, kind?: string }} props */
export function ActionButton({ id, label, withKey = false, kind = "" }) {
  const action = ACTIONS.get(id);
  if (!action) throw new Error(`No action is called ${id}.`);
  const key = keyOf(action),
    shown = label ?? action.short ?? action.label;
  return html`<button
    type="button"
    class=${kind}
    data-testid=${`do-${id}`}
    disabled=${!(action.enabled?.() ?? true)}
    aria-pressed=${action.pressed ? String(action.pressed()) : undefined}
    aria-label=${
      action.label.toLowerCase().includes(shown.toLowerCase()) || !/\w/.test(shown)
        ? action.label
        : `${shown}: ${action.label}`
    }
    aria-keyshortcuts=${key?.replace("ctrl", "Control").replace("shift", "Shift")}
    title=${key ? `${action.label} (${keyLabel(key)})` : action.label}
    onClick=${() => run(id)}
  >
    ${shown}
    ${
      withKey && key && key.length === 1 && key >= "a"
        ? html`
        ${" "}
        <kbd aria-hidden="true" data-key=${keyLabel(key)}></kbd>
      `
        : ""
    }
  </button>`;
}
