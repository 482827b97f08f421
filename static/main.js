// Wires the page: lists from the server, the address bar, keys, saving, fitting; then draws.
import { computed, effect, signal } from "@preact/signals";
import { render } from "preact";
import { useLayoutEffect, useRef } from "preact/hooks";
import { filePicker } from "./actions.js";
import { startJobs } from "./all_jobs.js";
import { startArrows } from "./arrows.js";
import { addPictures, atBoard, standing as boardStanding } from "./board.js";
import { startCapture } from "./capture.js";
import { startClips } from "./clips.js";
import { startColours } from "./colours.js";
import { liveStanding } from "./camera_desk.js";
import { startSaving } from "./draft.js";
import { startComparing } from "./comparing.js";
import { startPlaces } from "./field_places.js";
import { startFitting } from "./fitting.js";
import { startGrid } from "./grid.js";
import { startProposals } from "./ghost.js";
import { startHealth } from "./health.js";
import { startHeat } from "./heat.js";
import { startHeld } from "./held.js";
import { html } from "./html.js";
import { startKeys } from "./keys.js";
import { startLenses } from "./lenses.js";
import { Stage } from "./layers/stage.js";
import { BoardForm } from "./panels/board.js";
import { BordersPanel } from "./panels/borders.js";
import { Footer } from "./panels/footer.js";
import { Header } from "./panels/header.js";
import { Help } from "./panels/help.js";
import { LensReport } from "./panels/lens_report.js";
import { ModelPanel } from "./panels/model.js";
import { pageDesk } from "./panels/pages.js";
import { PairForm } from "./panels/pair.js";
import { PairReport } from "./panels/pair_report.js";
import { Notices } from "./panels/notices.js";
import { FieldPanel, FieldSummary, PictureAdvice, PictureHelp } from "./panels/picture.js";
import { LiveForm, LiveReport } from "./panels/live.js";
import { Tour } from "./panels/tour.js";
import { StraightForm, StraightReport } from "./panels/straight.js";
import { Figures } from "./panels/verdict.js";
import { ComparePanel, VersionsPanel } from "./panels/versions.js";
import { openFiles, startPair } from "./pair.js";
import { pairStanding, startPairing } from "./pairing.js";
import { loadLists, openFile } from "./pictures.js";
import { startRanking } from "./ranking.js";
import { startHovering } from "./residuals.js";
import { startRig } from "./rig.js";
import { startTracks } from "./rig_tracks.js";
import { startRolls } from "./rolls.js";
import { startScene } from "./scene.js";
import { startSeeing } from "./seeing.js";
import { startSeeingLook } from "./seeing_look.js";
import { startSnapping } from "./snapping.js";
import { opening, startRouter } from "./router.js";
import { atLive, atPair, atStraight, camera, help, step } from "./state.js";
import { Presence } from "./panels/presence.js";
import { startPresence } from "./presence.js";
import { current } from "./steps.js";
import { addEdgePictures, standing as straightStanding } from "./straight.js";
import { version } from "./versions.js";

const PICTURES = "image/png,image/jpeg,image/bmp,image/webp";
const dropping = signal(false);
/** What stands around a desk, where a lens is known without a field. */
const DESKS = {
  board: { label: "Lens", standing: boardStanding, Form: BoardForm, Report: LensReport, add: addPictures },
  straight: { label: "Straight edges", standing: straightStanding, Form: StraightForm, Report: StraightReport, add: addEdgePictures },
  live: { label: "Camera", standing: liveStanding, Form: LiveForm, Report: LiveReport, add: (/** @type {FileList} */ files) => openFile(files[0]) },
  pair: { label: "Two cameras", standing: pairStanding, Form: PairForm, Report: PairReport, add: openFiles },
};
const desk = computed(() => (pageDesk() ?? (atLive.value !== null ? DESKS.live : atBoard.value ? DESKS.board : atStraight.value ? DESKS.straight : atPair.value ? DESKS.pair : null)));

function App() {
  return html`<${Header}/><aside class="left" aria-label="This step"><${Guide}/><${Tour}/><${Left}/></aside>
    <div class="middle"><${Stage}/><${Notices}/></div>
    <aside class="right" aria-label="Results">${help.value ? html`<${Help}/>` : html`<${Right}/>`}</aside>
    <${Footer}/><${FileInput}/>${dropping.value && html`<div class="drop-hint" aria-hidden="true">Drop the picture to open it</div>`}`;
}

/** What is missing in this step, in one sentence. */
function Guide() {
  if (opening.value) return null;
  const at = desk.value, { label, done, sentence } = at ? { ...at.standing.value, label: at.label } : current.value;
  return html`<section class=${`guide${done ? " done" : ""}`} aria-live="polite">${(atPair.value || step.value !== "camera") && html`<h1 class="sr">${label} – Touchline</h1>`}<h2>${label}</h2><p data-testid="sentence">${sentence}</p><${Presence}/></section>`;
}

function Left() {
  if (opening.value) return null;
  if (desk.value) return html`<${desk.value.Form}/>`;
  switch (step.value) {
    case "camera": return html`<section><h2>How it goes</h2><ol class="plain"><li>Take or open a picture.</li><li>Say which field it shows, and which part.</li><li>Click along the four borders.</li><li>Look at the corrected picture.</li><li>Activate the version, or download it.</li></ol></section>`;
    case "picture": return html`<${FieldPanel}/>`;
    case "borders": return html`<${FieldSummary}/><${BordersPanel}/>`;
    case "model": return html`<${ModelPanel}/>`;
    case "compare": return html`<${ComparePanel}/>`;
    default: return html`<${VersionsPanel}/>`;
  }
}

function Right() {
  if (opening.value) return null;
  if (desk.value) return html`<${desk.value.Report}/>`;
  switch (step.value) {
    case "camera": return html`<${PictureAdvice}/>`;
    case "picture": return html`<${PictureHelp}/>`;
    case "borders": case "model": return html`<${Figures}/>`;
    default: return version.value && html`<${Figures} report=${version.value.report}/>`;
  }
}

/** Files for what the page is at. @param {FileList | null | undefined} files */
function take(files) {
  if (files?.length) void (desk.value ? desk.value.add(files) : openFile(files[0]));
}

/** The one file input; also drops and pastes anywhere on the page. */
function FileInput() {
  const input = useRef(/** @type {HTMLInputElement | null} */ (null));
  useLayoutEffect(() => {
    filePicker.open = () => input.current?.click();
    /** @type {Record<string, (e: any) => void>} */
    const on = {
      dragover: (e) => { if (e.dataTransfer?.types.includes("Files")) { e.preventDefault(); dropping.value = true; } },
      dragleave: (e) => { if (!e.relatedTarget) dropping.value = false; },
      drop: (e) => { e.preventDefault(); dropping.value = false; take(e.dataTransfer?.files); },
      paste: (e) => take(e.clipboardData?.files),
    };
    for (const [type, listener] of Object.entries(on)) addEventListener(type, listener);
    return () => { for (const [type, listener] of Object.entries(on)) removeEventListener(type, listener); };
  }, []);
  return html`<input ref=${input} type="file" data-testid="file" class="sr" tabindex="-1" aria-hidden="true" accept=${PICTURES}
    multiple=${desk.value !== null}
    onChange=${() => { const it = input.current; take(it?.files); if (it) it.value = ""; }}/>`;
}

async function start() {
  render(html`<${App}/>`, /** @type {HTMLElement} */ (document.getElementById("app")));
  startKeys();
  startFitting();
  startSaving();
  startSnapping();
  startProposals();
  startRanking();
  startComparing();
  startGrid();
  startHovering();
  startJobs();
  startPresence();
  startCapture();
  startHealth();
  startHeat();
  startArrows();
  startLenses();
  startPair();
  startPairing();
  startRig();
  startTracks();
  startRolls();
  startScene();
  startHeld();
  startSeeing();
  startColours();
  startClips();
  startPlaces();
  startSeeingLook();
  await startRouter(loadLists());
}

effect(() => { document.title = `${desk.value ? desk.value.label : current.value.label}${camera.value ? `, ${camera.value.name}` : ""} – Touchline`; });
void start();
