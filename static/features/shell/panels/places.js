// What every view beside calibrating and the start page shows: left, in the middle, and on the right.
import { computed } from "@preact/signals";
import { html } from "../../../core/html.js";
import { addressOf, route } from "../../../core/route.js";
import { isNowhere } from "../../../core/state.js";
import { addPictures } from "../../board/board.js";
import { BoardForm, BoardPage } from "../../board/panels/board.js";
import { CaptureForm, CapturePage, CaptureReport } from "../../board/panels/capture.js";
import { LensReport } from "../../board/panels/lens_report.js";
import { openFile } from "../../calibrate/pictures.js";
import { DetectionForm } from "../../detection/panels/colours.js";
import { DetectionPage } from "../../detection/panels/detection_page.js";
import { DetectionReport } from "../../detection/panels/detections.js";
import { JobsHelp, JobsPage } from "../../jobs/panels/jobs.js";
import {
  CameraForm,
  CameraPage,
  CameraPanel,
  CameraReport,
  SourceHelp,
  Tried,
} from "../../live/panels/camera_page.js";
import { openFiles } from "../../pair/pair.js";
import { PairForm } from "../../pair/panels/matches.js";
import { PairPage } from "../../pair/panels/pair_page.js";
import { PairReport } from "../../pair/panels/pair_report.js";
import { NewRig, RigForm, RigPage, RigReport } from "../../rig/panels/rig.js";
import { RollsForm, RollsPage, RollsReport } from "../../rolling/panels/rolls.js";
import { SceneForm, ScenePage, SceneReport } from "../../scene/panels/scene.js";
import { PageMenu, SettingsHelp, SettingsPage } from "../../settings/panels/settings.js";
import { StraightForm, StraightPage, StraightReport } from "../../straight/panels/straight.js";
import { addEdgePictures } from "../../straight/straight.js";
import { viewNextStep } from "../next_steps.js";
import { VersionListPage, VersionListReport } from "../../versions/panels/version_list.js";

/** @typedef {{ label: string, Form: any, Main: any, Report: any, add?: (files: FileList) => unknown }} Place */

/**
 * What each view shows: left, in the middle, and on the right. add: takes files that are opened, dropped or pasted.
 * @type {Record<Exclude<import("../../../core/route.js").View, "wall" | "calibrate">, Place>}
 */
const PLACES = {
  "new-camera": { label: "New camera", Form: SourceHelp, Main: CameraForm, Report: Tried },
  "camera-form": { label: "Change a camera", Form: SourceHelp, Main: CameraForm, Report: Tried },
  live: { label: "Camera", Form: CameraPanel, Main: CameraPage, Report: CameraReport, add: openFirst },
  detection: { label: "What it sees", Form: DetectionForm, Main: DetectionPage, Report: DetectionReport },
  versions: { label: "Saved versions", Form: PageMenu, Main: VersionListPage, Report: VersionListReport },
  "new-rig": { label: "Rig", Form: RigForm, Main: NewRig, Report: RigReport },
  rig: { label: "Rig", Form: RigForm, Main: RigPage, Report: RigReport },
  pair: { label: "Two cameras", Form: PairForm, Main: PairPage, Report: PairReport, add: openFiles },
  scene: { label: "Scene in 3-D", Form: SceneForm, Main: ScenePage, Report: SceneReport },
  board: { label: "Lens", Form: BoardForm, Main: BoardPage, Report: LensReport, add: addPictures },
  capture: { label: "Board before the camera", Form: CaptureForm, Main: CapturePage, Report: CaptureReport },
  edges: {
    label: "Straight edges",
    Form: StraightForm,
    Main: StraightPage,
    Report: StraightReport,
    add: addEdgePictures,
  },
  ball: { label: "Rolling ball", Form: RollsForm, Main: RollsPage, Report: RollsReport },
  jobs: { label: "Long work", Form: PageMenu, Main: JobsPage, Report: JobsHelp },
  server: { label: "Settings", Form: PageMenu, Main: SettingsPage, Report: SettingsHelp },
};

/** @type {Place} */
const NOWHERE = { label: "Nothing here", Form: () => null, Main: NothingHere, Report: () => null };

/** The place that is open, or null at the start page and while calibrating. */
export const place = computed(() => {
  const { view } = route.value,
    nextStep = viewNextStep.value;
  if (view === "wall" || view === "calibrate" || !nextStep) return null;
  return { ...(view === "nowhere" || isNowhere.value ? NOWHERE : PLACES[view]), nextStep };
});

/** @param {FileList} files */
function openFirst(files) {
  void openFile(files[0]);
}

function NothingHere() {
  const isCamera = route.value.camera !== "";
  return html`<div class="start">
    <h1>${isCamera ? "No such camera" : "Nothing here"}</h1>
    <p class="dim">${isCamera ? "It was removed, or the address is wrong." : "No page has this address."}</p>
    <p>
      <a href=${addressOf("wall")}>Back to the cameras</a>
    </p>
  </div>`;
}
