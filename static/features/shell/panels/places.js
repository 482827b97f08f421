// What every place beside the six steps shows: left, in the middle, and on the right.
import { computed } from "@preact/signals";
import { page } from "../../../core/page.js";
import { atBoard, atLive, atPair, atStraight } from "../../../core/state.js";
import { addPictures, boardNextStep } from "../../board/board.js";
import { BoardForm, BoardPage } from "../../board/panels/board.js";
import { CaptureForm, CapturePage, CaptureReport } from "../../board/panels/capture.js";
import { LensReport } from "../../board/panels/lens_report.js";
import { openFile } from "../../calibrate/pictures.js";
import { DetectionForm } from "../../detection/panels/colours.js";
import { DetectionPage } from "../../detection/panels/detection_page.js";
import { DetectionReport } from "../../detection/panels/detections.js";
import { JobsHelp, JobsPage } from "../../jobs/panels/jobs.js";
import { cameraNextStep } from "../../live/camera_page.js";
import { CameraPage, CameraPanel, CameraReport } from "../../live/panels/camera_page.js";
import { pairNextStep } from "../../pair/evaluation.js";
import { openFiles } from "../../pair/pair.js";
import { PairForm } from "../../pair/panels/matches.js";
import { PairPage } from "../../pair/panels/pair_page.js";
import { PairReport } from "../../pair/panels/pair_report.js";
import { RigForm, RigPage, RigReport } from "../../rig/panels/rig.js";
import { RollsForm, RollsPage, RollsReport } from "../../rolling/panels/rolls.js";
import { SceneForm, ScenePage, SceneReport } from "../../scene/panels/scene.js";
import { PageMenu, SettingsHelp, SettingsPage } from "../../settings/panels/settings.js";
import { pageNextStep } from "../page_steps.js";
import { StraightForm, StraightPage, StraightReport } from "../../straight/panels/straight.js";
import { addEdgePictures, straightNextStep } from "../../straight/straight.js";
import { VersionListPage, VersionListReport } from "../../versions/panels/version_list.js";

/** The pages beside the six steps, by their names in the address. */
const PAGES = {
  jobs: { label: "Long work", Form: PageMenu, Main: JobsPage, Report: JobsHelp },
  settings: { label: "Settings", Form: PageMenu, Main: SettingsPage, Report: SettingsHelp },
  versions: { label: "Saved versions", Form: PageMenu, Main: VersionListPage, Report: VersionListReport },
  capture: { label: "Board before the camera", Form: CaptureForm, Main: CapturePage, Report: CaptureReport },
  rig: { label: "Rig", Form: RigForm, Main: RigPage, Report: RigReport },
  rolls: { label: "Rolling ball", Form: RollsForm, Main: RollsPage, Report: RollsReport },
  scene: { label: "Scene in 3-D", Form: SceneForm, Main: ScenePage, Report: SceneReport },
  seeing: { label: "What it sees", Form: DetectionForm, Main: DetectionPage, Report: DetectionReport },
};

/** Where work goes on without a field. add: takes files that are opened, dropped or pasted there. */
const PLACES = {
  board: {
    label: "Lens",
    nextStep: boardNextStep,
    Form: BoardForm,
    Main: BoardPage,
    Report: LensReport,
    add: addPictures,
  },
  straight: {
    label: "Straight edges",
    nextStep: straightNextStep,
    Form: StraightForm,
    Main: StraightPage,
    Report: StraightReport,
    add: addEdgePictures,
  },
  live: {
    label: "Camera",
    nextStep: cameraNextStep,
    Form: CameraPanel,
    Main: CameraPage,
    Report: CameraReport,
    add: (/** @type {FileList} */ files) => openFile(files[0]),
  },
  pair: {
    label: "Two cameras",
    nextStep: pairNextStep,
    Form: PairForm,
    Main: PairPage,
    Report: PairReport,
    add: openFiles,
  },
};

/** The place that is open, or null at the six steps. */
export const place = computed(() =>
  page.value
    ? { ...PAGES[page.value.name], nextStep: pageNextStep, add: () => {} }
    : atLive.value !== null
      ? PLACES.live
      : atBoard.value
        ? PLACES.board
        : atStraight.value
          ? PLACES.straight
          : atPair.value
            ? PLACES.pair
            : null,
);
