// What every place beside the six steps shows: left, in the middle, and on the right.
import { computed } from "@preact/signals";
import { page } from "../../../core/page.js";
import { atBoard, atLive, atPair, atStraight } from "../../../core/state.js";
import { addPictures, standing as boardStanding } from "../../board/board.js";
import { BoardDesk, BoardForm } from "../../board/panels/board.js";
import { CaptureForm, CapturePage, CaptureReport } from "../../board/panels/capture.js";
import { LensReport } from "../../board/panels/lens_report.js";
import { openFile } from "../../calibrate/pictures.js";
import { SeeingForm } from "../../detection/panels/colours.js";
import { SeeingPage } from "../../detection/panels/detection_page.js";
import { SeeingReport } from "../../detection/panels/detections.js";
import { JobsHelp, JobsPage } from "../../jobs/panels/jobs.js";
import { liveStanding } from "../../live/camera_page.js";
import { LiveDesk, LiveForm, LiveReport } from "../../live/panels/camera_page.js";
import { pairStanding } from "../../pair/evaluation.js";
import { openFiles } from "../../pair/pair.js";
import { PairForm } from "../../pair/panels/matches.js";
import { PairDesk } from "../../pair/panels/pair_page.js";
import { PairReport } from "../../pair/panels/pair_report.js";
import { RigForm, RigPage, RigReport } from "../../rig/panels/rig.js";
import { RollsForm, RollsPage, RollsReport } from "../../rolling/panels/rolls.js";
import { SceneForm, ScenePage, SceneReport } from "../../scene/panels/scene.js";
import { PageMenu, SettingsHelp, SettingsPage } from "../../settings/panels/settings.js";
import { pageStanding } from "../page_steps.js";
import { StraightDesk, StraightForm, StraightReport } from "../../straight/panels/straight.js";
import { addEdgePictures, standing as straightStanding } from "../../straight/straight.js";
import { ShelfPage, ShelfReport } from "../../versions/panels/version_list.js";

/** The pages beside the six steps, by their names in the address. */
const PAGES = {
  jobs: { label: "Long work", Form: PageMenu, Main: JobsPage, Report: JobsHelp }, settings: { label: "Settings", Form: PageMenu, Main: SettingsPage, Report: SettingsHelp },
  versions: { label: "Saved versions", Form: PageMenu, Main: ShelfPage, Report: ShelfReport }, capture: { label: "Board before the camera", Form: CaptureForm, Main: CapturePage, Report: CaptureReport },
  rig: { label: "Rig", Form: RigForm, Main: RigPage, Report: RigReport },
  rolls: { label: "Rolling ball", Form: RollsForm, Main: RollsPage, Report: RollsReport }, scene: { label: "Scene in 3-D", Form: SceneForm, Main: ScenePage, Report: SceneReport },
  seeing: { label: "What it sees", Form: SeeingForm, Main: SeeingPage, Report: SeeingReport },
};

/** Where work goes on without a field. add: takes files that are opened, dropped or pasted there. */
const DESKS = {
  board: { label: "Lens", standing: boardStanding, Form: BoardForm, Main: BoardDesk, Report: LensReport, add: addPictures },
  straight: { label: "Straight edges", standing: straightStanding, Form: StraightForm, Main: StraightDesk, Report: StraightReport, add: addEdgePictures },
  live: { label: "Camera", standing: liveStanding, Form: LiveForm, Main: LiveDesk, Report: LiveReport, add: (/** @type {FileList} */ files) => openFile(files[0]) },
  pair: { label: "Two cameras", standing: pairStanding, Form: PairForm, Main: PairDesk, Report: PairReport, add: openFiles },
};

/** The place that is open, or null at the six steps. */
export const place = computed(() => (page.value ? { ...PAGES[page.value.name], standing: pageStanding, add: () => {} } : atLive.value !== null ? DESKS.live
  : atBoard.value ? DESKS.board : atStraight.value ? DESKS.straight : atPair.value ? DESKS.pair : null));
