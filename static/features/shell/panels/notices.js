// Messages above the picture; none of them blocks the work.
import { useEffect } from "preact/hooks";
import { SILENT, online } from "../../../core/api.js";
import { clock } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { dismiss, expireNotices, notices, renewNotices } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { rich } from "../../../ui/rich.js";
import { draft, keepMine, takeTheirs } from "../../calibrate/draft.js";

const LOOK_MS = 1000;
/** Whether they are being read: what the pointer or the focus is on does not go. */
const isRead = () =>
  document.hidden || document.querySelector(".notices:is(:hover, :focus-within)") !== null;

export function Notices() {
  const { state, theirs } = draft.value;
  useEffect(() => {
    const look = setInterval(() => (isRead() ? renewNotices() : expireNotices()), LOOK_MS);
    return () => clearInterval(look);
  }, []);
  return html`<div class="notices" role="status" aria-live="polite">
    ${
      !online.value &&
      html`<div class="notice warn" data-testid="away">
      <p>
        ${rich("shell.notices.away")}
      </p>
    </div>`
    }
    ${
      state === "conflict" &&
      theirs &&
      html`<div class="notice warn" data-testid="conflict">
      <p>
        ${
          theirs.at
            ? rich("shell.notices.conflict-at", {
                time: clock(theirs.at),
                count: points(theirs.doc),
              })
            : rich("shell.notices.conflict", { count: points(theirs.doc) })
        }
      </p>
      <div class="line">
        <button type="button" data-testid="take-theirs" onClick=${takeTheirs}>
          ${t("shell.notices.take-theirs")}
        </button>
        <button type="button" data-testid="keep-mine" onClick=${keepMine}>
          ${t("shell.notices.keep-mine")}
        </button>
      </div>
    </div>`
    }
    ${notices.value
      .filter(({ about }) => about !== SILENT || online.value) // said above
      .map(
        ({ id, level, text, fix, action }) =>
          html`<div key=${id} class=${`notice ${level}`} role="alert" data-testid="notice">
        <p>
          <b>${text}</b> ${fix}
        </p>
        <div class="line">
          ${
            action &&
            html`<button type="button" onClick=${action.run}>
            ${action.label}
          </button>`
          }
          <button type="button" aria-label=${t("shell.notices.dismiss.label")} onClick=${() => dismiss(id)}>
            ${t("shell.notices.dismiss")}
          </button>
        </div>
      </div>`,
      )}
  </div>`;
}

/** @param {import("../../../core/types").Doc} doc */
const points = (doc) => doc.observations.reduce((sum, o) => sum + o.points.length, 0);
