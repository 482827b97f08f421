// What every view beside calibrating shows: left, in the middle, and on the right.
import { computed } from "@preact/signals";
import { html } from "../../../core/html.js";
import { addressOf, route } from "../../../core/route.js";
import { isNowhere } from "../../../core/state.js";
import { addPictures } from "../../board/board.js";
import { BoardForm, BoardPage } from "../../board/panels/board.js";
import { CaptureForm, CapturePage, CaptureReport } from "../../board/panels/capture.js";
import { LensReport } from "../../board/panels/lens_report.js";
import { LensesPage } from "../../board/panels/lenses_page.js";
import { PictureAdvice } from "../../calibrate/panels/picture.js";
import { EditorPage } from "../../field_editor/panels/editor_page.js";
import { FieldForm } from "../../field_editor/panels/field_form.js";
import { FieldsPage } from "../../field_editor/panels/fields_page.js";
import { Markings } from "../../field_editor/panels/markings.js";
import { CheckReport } from "../../check/panels/check.js";
import { DetectionForm } from "../../detection/panels/colours.js";
import { DetectionPage } from "../../detection/panels/detection_page.js";
import { DetectionReport } from "../../detection/panels/detections.js";
import { DriftPage } from "../../drift/panels/drift_page.js";
import { JobsPage } from "../../jobs/panels/jobs.js";
import { CameraForm, SourceHelp, Tried } from "../../live/panels/camera_form.js";
import { CameraPage, CameraPanel, CameraReport } from "../../live/panels/camera_page.js";
import { CameraImagesPage, ImagesPage } from "../../library/panels/images.js";
import { Wall } from "../../live/panels/wall.js";
import { PublishingPage } from "../../network/panels/network.js";
import { openFiles } from "../../pair/pair.js";
import { PairForm } from "../../pair/panels/matches.js";
import { PairPage } from "../../pair/panels/pair_page.js";
import { PairReport } from "../../pair/panels/pair_report.js";
import { FieldPage } from "../../rig/panels/field_page.js";
import { NewRig } from "../../rig/panels/new_rig.js";
import { RigForm, RigPage, RigReport } from "../../rig/panels/rig.js";
import { RollsForm, RollsPage, RollsReport } from "../../rolling/panels/rolls.js";
import { SceneForm, ScenePage, SceneReport } from "../../scene/panels/scene.js";
import { SettingsPage } from "../../settings/panels/settings.js";
import { StraightForm, StraightPage, StraightReport } from "../../straight/panels/straight.js";
import { Readiness } from "./readiness.js";
import { addEdgePictures } from "../../straight/straight.js";
import { ImportPage } from "../../versions/panels/imports.js";
import { VersionListPage, VersionListReport } from "../../versions/panels/version_list.js";

/** @typedef {{ label: string, Main: any, Form?: any, Report?: any, add?: (files: FileList) => unknown }} Shown */

/**
 * What each view shows: in the middle, and where it has them at the left and on the right. add: takes files that are
 * opened, dropped or pasted there; elsewhere a picture is opened.
 * @type {Record<Exclude<import("../../../core/route.js").View, "calibrate">, Shown>}
 */
const VIEWS = {
  wall: { label: "Cameras", Main: Wall, Report: Readiness },
  "new-camera": { label: "New camera", Form: SourceHelp, Main: CameraForm, Report: Tried },
  live: { label: "Live", Form: CameraPanel, Main: CameraPage, Report: CameraReport },
  "camera-images": { label: "Calibrate", Main: CameraImagesPage, Report: PictureAdvice },
  drift: { label: "Drift", Main: DriftPage, Report: CheckReport },
  detection: { label: "Detection", Form: DetectionForm, Main: DetectionPage, Report: DetectionReport },
  "camera-form": { label: "Settings", Form: SourceHelp, Main: CameraForm, Report: Tried },
  field: { label: "Field", Main: FieldPage },
  "new-rig": { label: "New rig", Form: RigForm, Main: NewRig },
  rig: { label: "Rig", Form: RigForm, Main: RigPage, Report: RigReport },
  pair: { label: "Two cameras", Form: PairForm, Main: PairPage, Report: PairReport, add: openFiles },
  scene: { label: "Scene in 3-D", Form: SceneForm, Main: ScenePage, Report: SceneReport },
  lenses: { label: "Lenses", Main: LensesPage },
  board: { label: "Board", Form: BoardForm, Main: BoardPage, Report: LensReport, add: addPictures },
  capture: { label: "Board before the camera", Form: CaptureForm, Main: CapturePage, Report: CaptureReport },
  edges: {
    label: "Straight edges",
    Form: StraightForm,
    Main: StraightPage,
    Report: StraightReport,
    add: addEdgePictures,
  },
  ball: { label: "Rolling ball", Form: RollsForm, Main: RollsPage, Report: RollsReport },
  images: { label: "Images", Main: ImagesPage },
  versions: { label: "Versions", Main: VersionListPage, Report: VersionListReport },
  import: { label: "Import", Main: ImportPage },
  fields: { label: "Fields", Main: FieldsPage },
  "new-field": { label: "New field", Form: FieldForm, Main: EditorPage, Report: Markings },
  "field-editor": { label: "Field editor", Form: FieldForm, Main: EditorPage, Report: Markings },
  publishing: { label: "Publishing", Main: PublishingPage },
  jobs: { label: "Jobs", Main: JobsPage },
  server: { label: "Server", Main: SettingsPage },
};
/** @type {Shown} */
const NOWHERE = { label: "Nothing here", Main: NothingHere };

/** What is shown, or null while calibrating: that is the stage's. */
export const shown = computed(() => {
  const { view } = route.value;
  if (view === "nowhere" || isNowhere.value) return NOWHERE;
  return view === "calibrate" ? null : VIEWS[view];
});

function NothingHere() {
  const isCamera = route.value.camera !== "";
  return html`<div class="page">
    <h1>${isCamera ? "No such camera" : "Nothing here"}</h1>
    <p class="dim">${isCamera ? "It was removed, or the address is wrong." : "No page has this address."}</p>
    <p>
      <a href=${addressOf("wall")}>Back to the cameras</a>
    </p>
  </div>`;
}
