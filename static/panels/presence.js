// Beside the step: who else has this picture open.
import { html } from "../html.js";
import { others } from "../presence.js";

export function Presence() {
  const names = others.value;
  if (!names.length) return null;
  const known = [...new Set(names.filter(Boolean))], nameless = names.length - names.filter(Boolean).length;
  const who = [...known, ...(nameless ? [known.length ? `${nameless} more` : nameless === 1 ? "Somebody else" : `${nameless} others`] : [])].join(", ");
  return html`<p class="presence" data-testid="presence"><span aria-hidden="true">●</span> ${who} ${known.length + nameless > 1 ? "have" : "has"} this picture open too. Changes show at once on both sides.</p>`;
}
