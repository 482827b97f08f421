// The whole page: header, the step at the left, the stage in the middle, results at the right, footer.
import { computed, signal } from "@preact/signals";
import { useLayoutEffect, useRef } from "preact/hooks";
import { filePicker } from "../../../core/actions.js";
import { html } from "../../../core/html.js";
import { route } from "../../../core/route.js";
import { camera, help, opening, step } from "../../../core/state.js";
import { DockedLoupe } from "../../../canvas/layers/loupe.js";
import { Stage } from "../../../canvas/stage.js";
import { BordersPanel } from "../../calibrate/panels/borders.js";
import { FieldPanel, FieldSummary, PictureAdvice, PictureHelp } from "../../calibrate/panels/picture.js";
import { Presence } from "../../calibrate/panels/presence.js";
import { Figures } from "../../calibrate/panels/verdict.js";
import { openFile } from "../../calibrate/pictures.js";
import { HeatLegend } from "../../compare/panels/heat.js";
import { BlinkLegend, GridLegend } from "../../compare/panels/legends.js";
import { ArrowLegend } from "../../compare/panels/residual_arrows.js";
import { Help } from "../../help/panels/help.js";
import { Tour } from "../../help/panels/tour.js";
import { current } from "../steps.js";
import { ComparePanel, VersionsPanel } from "../../versions/panels/versions.js";
import { version } from "../../versions/versions.js";
import { Checklist } from "../../verify/panels/checklist.js";
import { Footer } from "./footer.js";
import { Header } from "./header.js";
import { Notices } from "./notices.js";
import { place } from "./places.js";
import { Start } from "./start.js";

const PICTURES = "image/png,image/jpeg,image/bmp,image/webp";
const dropping = signal(false);
/** What the browser's tab is called. */
export const title = computed(() => {
  const name = camera.value ? `, ${camera.value.name}` : "";
  return `${place.value ? place.value.label : current.value.label}${name} – Touchline`;
});

export function App() {
  return html`
    <${Header} />
    <aside class="left" aria-label="This step">
      <${Guide} />
      <${Tour} />
      <${Left} />
    </aside>
    <main class="middle">
      <${Stage} Empty=${Middle} Legends=${Legends} />
      <${Notices} />
    </main>
    <aside class="right" aria-label="Results">
      <${DockedLoupe} />
      ${help.value ? html`<${Help} />` : html`<${Right} />`}
    </aside>
    <${Footer} />
    <${FileInput} />
    ${dropping.value && html`<div class="drop-hint" aria-hidden="true">
      Drop the picture to open it
    </div>`}
  `;
}

/** What stands in the middle while no picture does. */
const Middle = () => {
  const Main = place.value?.Main ?? Start;
  return html`<${Main} />`;
};

/** The words beside what is drawn on the picture. */
const Legends = () => html`
  <${BlinkLegend} />
  <${GridLegend} />
  <${ArrowLegend} />
  <${HeatLegend} />
`;

/** What is missing in this step, in one sentence. */
function Guide() {
  if (opening.value) return null;
  const at = place.value,
    { label, done, sentence } = at ? { ...at.nextStep, label: at.label } : current.value;
  return html`<section class=${`guide${done ? " done" : ""}`} aria-live="polite">
    ${(route.value.view === "pair" || step.value) && html`<h1 class="sr">${label} – Touchline</h1>`}
    <h2>${label}</h2>
    <p data-testid="sentence">${sentence}</p>
    <${Presence} />
  </section>`;
}

function Left() {
  if (opening.value) return null;
  if (place.value) return html`<${place.value.Form} />`;
  switch (step.value) {
    case "":
      return html`<section>
        <h2>How it goes</h2>
        <ol class="plain">
          <li>Choose a camera, or open an image.</li>
          <li>Check the field type and the area the camera covers.</li>
          <li>Check the detected lines. Add or move points where they are wrong.</li>
          <li>Verify the result, and activate it.</li>
        </ol>
      </section>`;
    case "field":
      return html`<${FieldPanel} />`;
    case "points":
      return html`
        <${FieldSummary} />
        <${BordersPanel} />
      `;
    default:
      return html`
        <${Checklist} />
        <${ComparePanel} />
        <${VersionsPanel} />
      `;
  }
}

function Right() {
  if (opening.value) return null;
  if (place.value) return html`<${place.value.Report} />`;
  switch (step.value) {
    case "":
      return html`<${PictureAdvice} />`;
    case "field":
      return html`<${PictureHelp} />`;
    case "points":
      return html`<${Figures} />`;
    default:
      return version.value && html`<${Figures} report=${version.value.report} />`;
  }
}

/** Files for what the page is at. @param {FileList | null | undefined} files */
function take(files) {
  if (files?.length) void (place.value ? place.value.add?.(files) : openFile(files[0]));
}

/** The one file input; also drops and pastes anywhere on the page. */
function FileInput() {
  const input = useRef(/** @type {HTMLInputElement | null} */ (null));
  useLayoutEffect(() => {
    filePicker.open = () => input.current?.click();
    /** @type {Record<string, (e: any) => void>} */
    const on = {
      dragover: (e) => {
        if (e.dataTransfer?.types.includes("Files")) {
          e.preventDefault();
          dropping.value = true;
        }
      },
      dragleave: (e) => {
        if (!e.relatedTarget) dropping.value = false;
      },
      drop: (e) => {
        e.preventDefault();
        dropping.value = false;
        take(e.dataTransfer?.files);
      },
      paste: (e) => take(e.clipboardData?.files),
    };
    for (const [type, listener] of Object.entries(on)) addEventListener(type, listener);
    return () => {
      for (const [type, listener] of Object.entries(on)) removeEventListener(type, listener);
    };
  }, []);
  return html`<input
    ref=${input}
    type="file"
    data-testid="file"
    class="sr"
    tabindex="-1"
    aria-hidden="true"
    accept=${PICTURES}
    multiple=${place.value !== null}
    onChange=${() => {
      const it = input.current;
      take(it?.files);
      if (it) it.value = "";
    }}
  />`;
}
