// Top of the page: where the picture comes from, the steps, whether all is saved, and the one bright button.
import { signal } from "@preact/signals";
import { run } from "../../../core/actions.js";
import { online } from "../../../core/api.js";
import { ago } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf, route } from "../../../core/route.js";
import { busy, camera, help, opening, snapshot, step } from "../../../core/state.js";
import { ActionButton } from "../../../ui/action_button.js";
import { draft } from "../../calibrate/draft.js";
import { JobsIndicator } from "../../jobs/panels/jobs.js";
import { both } from "../../pair/pair.js";
import { saving } from "../../versions/versions.js";
import { nextAction, steps } from "../steps.js";

const now = signal(Date.now());
setInterval(() => {
  now.value = Date.now();
}, 1000);

export function Header() {
  return html`<header>
    <a class="skip" href=${addressOf("wall")} onClick=${toStage}>
      Skip to the picture
    </a>
    <a class="brand" href=${addressOf("wall")} aria-label="Touchline, start page">
      <${Logo} />
      <span>Touchline</span>
    </a>
    ${snapshot.value && html`<button
      type="button"
      class="round"
      data-testid="step-camera"
      aria-label="Back to the cameras"
      title="Back to the cameras"
      onClick=${() => run("step-camera")}
    >
      ‹
    </button>`}
    ${snapshot.value && html`<span class="pill" title="Where the picture comes from">
      ${camera.value?.name ?? "Picture from a file"}
      <small>
        ${snapshot.value.width} × ${snapshot.value.height} px
      </small>
    </span>`}
    <nav aria-label="Steps">
      <ol>
        ${steps.value.map(({ id, label, done, open, sentence }) => html`<li key=${id}>
          <button
            type="button"
            data-testid=${`step-${id}`}
            class=${id === step.value ? "now" : done ? "done" : "todo"}
            disabled=${!open}
            aria-current=${id === step.value ? "step" : undefined}
            title=${sentence}
            onClick=${() => run(`step-${id}`)}
          >
            <span aria-hidden="true" class="mark">
              ${id === step.value ? "●" : done ? "✓" : "○"}
            </span>
            ${label}
            <span class="sr">
              ${done ? ", done. " : ". "}
              ${sentence}
            </span>
          </button>
        </li>`)}
      </ol>
    </nav>
    <${JobsIndicator} />
    <${Saved} />
    <a
      class="round as-button"
      href=${addressOf("server")}
      data-testid="to-settings"
      aria-label="Settings, long work, saved versions"
      title="Settings, long work, saved versions"
    >
      ⚙
    </a>
    <button
      type="button"
      class="round"
      data-testid="help"
      aria-label="Open help"
      aria-expanded=${help.value !== ""}
      onClick=${() => run(help.value ? "escape" : "manual")}
    >
      ?
    </button>
    ${saving.value && html`<${ActionButton} id="stop-saving" />`}
    <${Next} />
  </header>`;
}

/** Past the header and the panel, by keyboard. @param {MouseEvent} e */
function toStage(e) {
  e.preventDefault(); // the address bar is the router's
  /** @type {HTMLElement | null} */ (document.querySelector(".stage"))?.focus();
}

function Next() {
  const { action, label, missing } = nextAction.value;
  const doing = busy.value || (opening.value ? "Opening…" : ""),
    waits = doing !== "" || missing !== "";
  return html`<button
    type="button"
    class="go"
    data-testid="next"
    aria-disabled=${waits}
    title=${missing || label}
    onClick=${() => {
      if (!waits) run(action);
    }}
  >
    ${doing || label}
  </button>`;
}

function Saved() {
  const { state, at } = draft.value,
    isKept = route.value.view === "pair" && both.value;
  if (state === "none")
    return html`<span class="saved" data-testid=${isKept ? "kept" : undefined}>
      ${isKept ? "Kept in this browser" : ""}
    </span>`;
  const text =
    !online.value || state === "away"
      ? "Kept in this browser"
      : state === "saved"
        ? `Saved ${ago(at, now.value)}`
        : state === "unsaved"
          ? "Saving…"
          : "Not saved";
  return html`<span class=${`saved ${state}`} data-testid="saved" data-state=${state}>
    ${text}
  </span>`;
}

const Logo = () => html`<svg width="22" height="22" viewBox="0 0 22 22" aria-hidden="true">
  <path
    fill="none"
    stroke="currentColor"
    stroke-width="2"
    stroke-linecap="round"
    d="M3 3Q6 11 3 19M19 3Q16 11 19 19M3 3Q11 6 19 3M3 19Q11 16 19 19"
  />
</svg>`;
