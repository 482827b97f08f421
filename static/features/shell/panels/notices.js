// Messages above the picture; none of them blocks the work.
import { online } from "../../../core/api.js";
import { clock, plural } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { dismiss, notices } from "../../../core/state.js";
import { draft, keepMine, takeTheirs } from "../../calibrate/draft.js";

export function Notices() {
  const { state, theirs } = draft.value;
  return html`<div class="notices" role="status" aria-live="polite">
    ${!online.value && html`<div class="notice warn" data-testid="away">
      <p>
        <b>The server does not answer.</b> Keep working: your clicks are kept in this browser, and are sent
        as soon as it is back.
      </p>
    </div>`}
    ${state === "conflict" && theirs && html`<div class="notice warn" data-testid="conflict">
      <p>
        <b>Somebody else changed this draft${theirs.at ? ` at ${clock(theirs.at)}` : ""}.</b> Theirs has${" "}
        ${plural(points(theirs.doc), "point")}. Nothing is lost: the other one stays one undo away.
      </p>
      <div class="line">
        <button type="button" data-testid="take-theirs" onClick=${takeTheirs}>
          Take theirs
        </button>
        <button type="button" data-testid="keep-mine" onClick=${keepMine}>
          Keep mine
        </button>
      </div>
    </div>`}
    ${notices.value.map(({ id, level, text, fix, action }) => 
      html`<div key=${id} class=${`notice ${level}`} role="alert" data-testid="notice">
        <p>
          <b>${text}</b> ${fix}
        </p>
        <div class="line">
          ${action && html`<button type="button" onClick=${action.run}>
            ${action.label}
          </button>`}
          <button type="button" aria-label="Dismiss this message" onClick=${() => dismiss(id)}>
            Dismiss
          </button>
        </div>
      </div>`)}
  </div>`;
}

/** @param {import("../../../core/types").Doc} doc */
const points = (doc) => doc.observations.reduce((sum, o) => sum + o.points.length, 0);
