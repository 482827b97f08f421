// The whole page: the rail, the top bar, the form at the left, the view in the middle, results at the right, status.
import { computed, signal } from "@preact/signals";
import { useLayoutEffect, useRef } from "preact/hooks";
import { filePicker } from "../../../core/actions.js";
import { html } from "../../../core/html.js";
import { addressOf, route } from "../../../core/route.js";
import { camera, help, namedCamera, opening } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { Stage } from "../../../canvas/stage.js";
import { openFile } from "../../calibrate/pictures.js";
import { HeatLegend } from "../../compare/panels/heat.js";
import { BlinkLegend, GridLegend } from "../../compare/panels/legends.js";
import { ArrowLegend } from "../../compare/panels/residual_arrows.js";
import { Tour } from "../../help/panels/tour.js";
import { tour } from "../../help/tour.js";
import { current } from "../steps.js";
import { later } from "../../../ui/later.js";
import { ACCEPTED } from "../../versions/imports.js";
import { ActivationWarning } from "../../versions/panels/activation_warning.js";
import { problems } from "../problems.js";
import { Guide } from "./guide.js";
import { Notices } from "./notices.js";
import { Palette } from "./palette.js";
import { Rail } from "./rail.js";
import { StatusBar } from "./status_bar.js";
import { StepPanel } from "./step_panel.js";
import { Tabs } from "./tabs.js";
import { TopBar } from "./top_bar.js";
import { shown } from "./views.js";

const PICTURES = "image/png,image/jpeg,image/bmp,image/webp";
const dropping = signal(false);
const Help = later(() => import("../../help/panels/help.js").then((it) => it.Help));
/** What the browser's tab is called. */
export const title = computed(() => {
  const name = (camera.value ?? namedCamera.value)?.name;
  const worst = problems.value.find((it) => it.level === "bad");
  if (worst) return `▲ ${worst.text.replace(/\.$/, "")} – Touchline`;
  return `${name ? `${name}, ` : ""}${(shown.value ?? current.value).label} – Touchline`;
});

export function App() {
  return html`
    <a class="skip" href=${addressOf("wall")} onClick=${toStage}>${t("shell.skip")}</a>
    <${Rail} />
    <${TopBar} />
    <${Left} />
    <main class="middle">
      <${Tabs} />
      <${Middle} />
      <${Notices} />
    </main>
    <${Right} />
    <${StatusBar} />
    <${FileInput} />
    <${Palette} />
    <${ActivationWarning} />
    ${
      dropping.value &&
      html`<div class="drop-hint" aria-hidden="true">
      ${t("shell.drop")}
    </div>`
    }
  `;
}

/** Past the rail, the bars and the panel, by keyboard. @param {MouseEvent} e */
function toStage(e) {
  e.preventDefault(); // the address bar is the route's
  /** @type {HTMLElement | null} */ (document.querySelector(".stage"))?.focus();
}

/** The stage while calibrating, else the page of the view. */
function Middle() {
  if (opening.value)
    return html`<section class="stage empty" aria-busy="true" tabindex="-1">
      <p class="dim page">${t("shell.opening")}</p>
    </section>`;
  const Main = shown.value?.Main;
  if (!Main) return html`<${Stage} Legends=${Legends} />`;
  const kind = ["match", "field-editor", "new-field"].includes(route.value.view)
    ? "paired"
    : "empty";
  return html`<section class=${`stage ${kind}`} tabindex="-1" data-testid="stage">
    <${Main} />
  </section>`;
}

/** The words beside what is drawn on the picture. */
const Legends = () => html`
  <${BlinkLegend} />
  <${GridLegend} />
  <${ArrowLegend} />
  <${HeatLegend} />
`;

/** What to do here, in one sentence, and the form for it; nothing where the view is a list. While calibrating, that
 * is in the one panel at the right, and here is the manual, so that it covers nothing that it speaks of. */
function Left() {
  const it = shown.value;
  if (it ? !it.Form && !tour.value.on : !help.value) return null;
  return html`<aside class="left" aria-label=${it ? t("shell.left") : t("shell.help")}>
    ${it?.Form && !opening.value && html`<${Guide} />`}
    ${it ? html`<${Tour} />` : html`<${Help} />`}
    ${it?.Form && !opening.value && html`<${it.Form} />`}
  </aside>`;
}

/** What came of it, or the manual; while calibrating, all that belongs to the step. */
function Right() {
  const it = shown.value;
  if (!it) return html`<aside class="right" aria-label=${t("shell.left")}><${StepPanel} /></aside>`;
  if (!it.Report && !help.value) return null;
  return html`<aside class="right" aria-label=${t("shell.right")}>
    ${help.value ? html`<${Help} />` : !opening.value && html`<${it.Report} />`}
  </aside>`;
}

const openFirst = (/** @type {FileList} */ files) => openFile(files[0]);

/** Files for what the page is at. @param {FileList | null | undefined} files */
function take(files) {
  if (files?.length) void (shown.value?.add ?? openFirst)(files);
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
    accept=${shown.value?.add ? PICTURES : `${PICTURES},${ACCEPTED}`}
    multiple=${Boolean(shown.value?.add)}
    onChange=${() => {
      const it = input.current;
      take(it?.files);
      if (it) it.value = "";
    }}
  />`;
}
