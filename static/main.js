// Wires the page: lists from the server, the address bar, keys, saving, fitting; then draws.
import { computed, effect, signal } from "@preact/signals";
import { render } from "preact";
import { useLayoutEffect, useRef } from "preact/hooks";
import { filePicker } from "./features/shell/action_table.js";
import { startJobs } from "./features/jobs/job_list.js";
import { startArrows } from "./features/compare/residual_arrows.js";
import { addPictures, atBoard, standing as boardStanding } from "./features/board/board.js";
import { startCapture } from "./features/board/capture.js";
import { startClips } from "./features/detection/clips.js";
import { startColours } from "./features/detection/colours.js";
import { liveStanding } from "./features/live/camera_page.js";
import { startSaving } from "./features/calibrate/draft.js";
import { startComparing } from "./features/compare/comparison.js";
import { startPlaces } from "./features/detection/field_positions.js";
import { startFitting } from "./features/calibrate/fitting.js";
import { startGrid } from "./features/compare/grid.js";
import { startProposals } from "./features/calibrate/line_suggestions.js";
import { startHealth } from "./features/shell/health.js";
import { startHeat } from "./features/compare/heat.js";
import { startHeld } from "./features/detection/held_frame.js";
import { html } from "./core/html.js";
import { startKeys } from "./core/keys.js";
import { startLenses } from "./features/board/lenses.js";
import { Stage } from "./canvas/stage.js";
import { BoardForm } from "./features/board/panels/board.js";
import { BordersPanel } from "./features/calibrate/panels/borders.js";
import { Footer } from "./features/shell/panels/footer.js";
import { Header } from "./features/shell/panels/header.js";
import { Help } from "./features/help/panels/help.js";
import { LensReport } from "./features/board/panels/lens_report.js";
import { ModelPanel } from "./features/calibrate/panels/model.js";
import { pageDesk } from "./features/shell/panels/pages.js";
import { PairForm } from "./features/pair/panels/matches.js";
import { PairReport } from "./features/pair/panels/pair_report.js";
import { Notices } from "./features/shell/panels/notices.js";
import { FieldPanel, FieldSummary, PictureAdvice, PictureHelp } from "./features/calibrate/panels/picture.js";
import { LiveForm, LiveReport } from "./features/live/panels/camera_page.js";
import { Tour } from "./features/help/panels/tour.js";
import { StraightForm, StraightReport } from "./features/straight/panels/straight.js";
import { Figures } from "./features/calibrate/panels/verdict.js";
import { ComparePanel, VersionsPanel } from "./features/versions/panels/versions.js";
import { openFiles, startPair } from "./features/pair/pair.js";
import { pairStanding, startPairing } from "./features/pair/evaluation.js";
import { loadLists, openFile } from "./features/calibrate/pictures.js";
import { startRanking } from "./features/calibrate/model_ranking.js";
import { startHovering } from "./features/calibrate/residuals.js";
import { startRig } from "./features/rig/rig.js";
import { startTracks } from "./features/rig/tracks.js";
import { startRolls } from "./features/rolling/rolls.js";
import { startScene } from "./features/scene/scene.js";
import { startSeeing } from "./features/detection/detection.js";
import { startSeeingLook } from "./features/detection/display.js";
import { startSnapping } from "./features/calibrate/snapping.js";
import { opening, startRouter } from "./core/router.js";
import { atLive, atPair, atStraight, camera, help, step } from "./core/state.js";
import { Presence } from "./features/calibrate/panels/presence.js";
import { startPresence } from "./features/calibrate/presence.js";
import { current } from "./features/shell/steps.js";
import { addEdgePictures, standing as straightStanding } from "./features/straight/straight.js";
import { version } from "./features/versions/versions.js";

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
