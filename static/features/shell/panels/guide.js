// What is missing in this step or view, in one sentence.
import { html } from "../../../core/html.js";
import { route } from "../../../core/route.js";
import { step } from "../../../core/state.js";
import { viewNextStep } from "../next_steps.js";
import { current } from "../steps.js";
import { shown } from "./views.js";

export function Guide() {
  const it = shown.value,
    { label } = it ?? current.value,
    { done, sentence } = (it ? viewNextStep.value : current.value) ?? { done: false, sentence: "" };
  return html`<section class=${`guide${done ? " done" : ""}`} aria-live="polite">
    ${(route.value.view === "match" || step.value) && html`<h1 class="sr">${label} – Touchline</h1>`}
    <h2>${label}</h2>
    <p data-testid="sentence">${sentence}</p>
  </section>`;
}
