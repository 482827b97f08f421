// At the foot of the left panel, where nothing jumps: who else has this picture open, and what they have just changed.
import { undo } from "../../../core/document.js";
import { html } from "../../../core/html.js";
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
      ? [known.length ? `${nameless} more` : nameless === 1 ? "Somebody else" : `${nameless} others`]
      : []),
  ].join(", ");
  return html`<div class="presence">
    ${isTheirs() && html`<div class="line" role="status" data-testid="changed-by">
      <span class="grow">
        <b>${changedBy.value?.name}</b> changed the draft.
      </span>
      <button type="button" data-testid="undo-theirs" onClick=${undo}>
        Undo
      </button>
    </div>`}
    ${names.length > 0 && html`<p data-testid="presence">
      <span aria-hidden="true">●</span> ${who} ${known.length + nameless > 1 ? "have" : "has"} this picture
      open too. Changes show at once on both sides.
    </p>`}
  </div>`;
}
