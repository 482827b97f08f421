// At the foot of the left panel, where nothing jumps: who else has this picture open, and what they have just changed.
import { undo } from "../../../core/document.js";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { rich } from "../../../ui/rich.js";
import { changedBy, isTheirs } from "../draft.js";
import { others } from "../presence.js";

export function Presence() {
  const names = others.value;
  if (!names.length && !isTheirs()) return null;
  const known = [...new Set(names.filter(Boolean))],
    nameless = names.length - names.filter(Boolean).length;
  const who = [
    ...known,
    ...(nameless
      ? [
          known.length
            ? t("calibrate.presence.more", { count: nameless })
            : t("calibrate.presence.nameless", { count: nameless }),
        ]
      : []),
  ].join(", ");
  return html`<div class="presence">
    ${
      isTheirs() &&
      html`<div class="line" role="status" data-testid="changed-by">
      <span class="grow">
        ${rich("calibrate.presence.changed", { name: changedBy.value?.name })}
      </span>
      <button type="button" data-testid="undo-theirs" onClick=${undo}>
        ${t("common.undo")}
      </button>
    </div>`
    }
    ${
      names.length > 0 &&
      html`<p data-testid="presence">
      <span aria-hidden="true">●</span> ${t("calibrate.presence.open", { count: known.length + nameless, who })}
    </p>`
    }
  </div>`;
}
