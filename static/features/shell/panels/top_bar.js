// Top of the page: where it is, the steps of calibrating, and the one bright button.
import { run } from "../../../core/actions.js";
import { shortened } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { keyLabel } from "../../../core/keys.js";
import { addressOf, route } from "../../../core/route.js";
import {
  busy,
  camera,
  cameras,
  namedCamera,
  opening,
  snapshot,
  step,
} from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { saving } from "../../versions/versions.js";
import { openPalette } from "../palette.js";
import { PLACES } from "../places.js";
import { nextAction, steps } from "../steps.js";
import { Bell } from "./bell.js";

export function TopBar() {
  return html`<header>
    <${Where} />
    ${route.value.view === "calibrate" && html`<${Steps} />`}
    <div class="acts">
      <button
        type="button"
        class="search"
        data-testid="search"
        aria-label=${t("shell.palette.title")}
        onClick=${openPalette}
      >
        <span>${t("shell.top.search")}</span> <kbd aria-hidden="true" data-key=${keyLabel("ctrl+k")}></kbd>
      </button>
      <${Bell} />
      ${saving.value && html`<${ActionButton} id="stop-saving" />`}
      <${Next} />
    </div>
  </header>`;
}

/** The camera or the image that the page is at, else the place. */
function Where() {
  const { view, place } = route.value,
    picture = snapshot.value,
    it = view === "calibrate" ? camera.value : place === "cameras" ? namedCamera.value : null;
  const isInside = view === "calibrate" || it !== null || view === "new-camera";
  const name =
    it?.name ??
    (view === "calibrate"
      ? picture?.name || t("shell.top.file")
      : PLACES.find((p) => p.place === place)?.label);
  return html`<div class="where">
    ${
      isInside &&
      html`<a
      class="round as-button"
      href=${addressOf("wall")}
      data-testid="step-camera"
      aria-label=${t("shell.back-to-cameras")}
      title=${t("shell.back-to-cameras")}
    >
      ‹
    </a>`
    }
    <b>${name ?? "Touchline"}</b>
    ${picture && html`<small>${picture.width} × ${picture.height} px</small>`}
  </div>`;
}

const Steps = () => html`<nav class="steps" aria-label=${t("shell.steps.title")}>
  <ol>
    ${steps.value.map(
      ({ id, label, done, open, sentence }) => html`<li key=${id}>
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
          ${done ? t("shell.steps.done") : ". "}
          ${sentence}
        </span>
      </button>
    </li>`,
    )}
  </ol>
</nav>`;

const LABEL_CHARACTERS = 40, // on two lines, where the bar is narrow
  MIN_NAME_CHARACTERS = 12;
/** What the button says: cameras with long names are shortened. @param {string} label */
const fitting = (label) =>
  cameras.value.reduce((text, { name }) => {
    const room = LABEL_CHARACTERS - (text.length - name.length);
    return text.replace(name, shortened(name, Math.max(room, MIN_NAME_CHARACTERS)));
  }, label);

function Next() {
  const { action, label, missing } = nextAction.value;
  if (!action) return null;
  const doing = busy.value || (opening.value ? t("shell.opening") : ""),
    waits = doing !== "" || missing !== "";
  return html`<button
    type="button"
    class="go"
    data-testid="next"
    aria-disabled=${waits}
    title=${missing || doing || label}
    onClick=${() => {
      if (!waits) run(action);
    }}
  >
    ${fitting(doing || label)}
  </button>`;
}
