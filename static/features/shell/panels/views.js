// What every view beside calibrating shows: left, in the middle, and on the right.
import { computed } from "@preact/signals";
import { html } from "../../../core/html.js";
import { addressOf, route } from "../../../core/route.js";
import { isNowhere } from "../../../core/state.js";
import { t } from "../../../core/words.js";
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
import { FieldPage } from "../../rig/panels/field_page.js";
import { MatchDesk } from "../../rig/panels/match_desk.js";
import { MatchList } from "../../rig/panels/match_list.js";
import { NewRig } from "../../rig/panels/new_rig.js";
import { RigForm, RigPage } from "../../rig/panels/rig.js";
import { MatchReport, RigReport } from "../../rig/panels/rig_report.js";
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
  wall: { label: t("shell.place.cameras"), Main: Wall, Report: Readiness },
  "new-camera": { label: t("shell.view.new-camera"), Form: SourceHelp, Main: CameraForm, Report: Tried },
  live: { label: t("shell.view.live"), Form: CameraPanel, Main: CameraPage, Report: CameraReport },
  "camera-images": { label: t("shell.view.camera-images"), Main: CameraImagesPage, Report: PictureAdvice },
  drift: { label: t("shell.view.drift"), Main: DriftPage, Report: CheckReport },
  detection: { label: t("shell.view.detection"), Form: DetectionForm, Main: DetectionPage, Report: DetectionReport },
  "camera-form": { label: t("shell.view.camera-form"), Form: SourceHelp, Main: CameraForm, Report: Tried },
  field: { label: t("shell.place.field"), Main: FieldPage },
  "new-rig": { label: t("shell.view.new-rig"), Form: RigForm, Main: NewRig },
  rig: { label: t("shell.view.rig"), Form: RigForm, Main: RigPage, Report: RigReport },
  match: { label: t("rig.match.title"), Form: MatchList, Main: MatchDesk, Report: MatchReport },
  "former-pair": { label: t("shell.place.field"), Main: FieldPage },
  scene: { label: t("common.scene"), Form: SceneForm, Main: ScenePage, Report: SceneReport },
  lenses: { label: t("shell.place.lenses"), Main: LensesPage },
  board: { label: t("shell.view.board"), Form: BoardForm, Main: BoardPage, Report: LensReport, add: addPictures },
  capture: { label: t("shell.view.capture"), Form: CaptureForm, Main: CapturePage, Report: CaptureReport },
  edges: {
    label: t("shell.view.edges"),
    Form: StraightForm,
    Main: StraightPage,
    Report: StraightReport,
    add: addEdgePictures,
  },
  ball: { label: t("shell.view.ball"), Form: RollsForm, Main: RollsPage, Report: RollsReport },
  images: { label: t("shell.view.images"), Main: ImagesPage },
  versions: { label: t("shell.view.versions"), Main: VersionListPage, Report: VersionListReport },
  import: { label: t("shell.view.import"), Main: ImportPage },
  fields: { label: t("shell.view.fields"), Main: FieldsPage },
  "new-field": { label: t("shell.view.new-field"), Form: FieldForm, Main: EditorPage, Report: Markings },
  "field-editor": { label: t("shell.view.field-editor"), Form: FieldForm, Main: EditorPage, Report: Markings },
  publishing: { label: t("shell.view.publishing"), Main: PublishingPage },
  jobs: { label: t("shell.view.jobs"), Main: JobsPage },
  server: { label: t("shell.view.server"), Main: SettingsPage },
};
/** @type {Shown} */
const NOWHERE = { label: t("shell.nowhere.title"), Main: NothingHere };

/** What is shown, or null while calibrating: that is the stage's. */
export const shown = computed(() => {
  const { view } = route.value;
  if (view === "nowhere" || isNowhere.value) return NOWHERE;
  return view === "calibrate" ? null : VIEWS[view];
});

function NothingHere() {
  const isCamera = route.value.camera !== "";
  return html`<div class="page">
    <h1>${isCamera ? t("shell.nowhere.no-camera") : t("shell.nowhere.title")}</h1>
    <p class="dim">${isCamera ? t("shell.nowhere.no-camera.text") : t("shell.nowhere.text")}</p>
    <p>
      <a href=${addressOf("wall")}>${t("shell.back-to-cameras")}</a>
    </p>
  </div>`;
}
