// What a page beside the steps shows: left, in the middle, and on the right.
import { html } from "../../../core/html.js";
import { page } from "../../../core/page.js";
import { pageStanding } from "../page_steps.js";
import { CaptureForm, CapturePage, CaptureReport } from "../../board/panels/capture.js";
import { JobsHelp, JobsPage } from "../../jobs/panels/jobs.js";
import { PageMenu, SettingsHelp, SettingsPage } from "../../settings/panels/settings.js";
import { RigForm, RigPage, RigReport } from "../../rig/panels/rig.js";
import { RollsForm, RollsPage, RollsReport } from "../../rolling/panels/rolls.js";
import { SceneForm, ScenePage, SceneReport } from "../../scene/panels/scene.js";
import { SeeingForm } from "../../detection/panels/colours.js";
import { SeeingPage } from "../../detection/panels/detection_page.js";
import { SeeingReport } from "../../detection/panels/detections.js";
import { ShelfPage, ShelfReport } from "../../versions/panels/version_list.js";

const PAGES = {
  jobs: { label: "Long work", Form: PageMenu, Main: JobsPage, Report: JobsHelp }, settings: { label: "Settings", Form: PageMenu, Main: SettingsPage, Report: SettingsHelp },
  versions: { label: "Saved versions", Form: PageMenu, Main: ShelfPage, Report: ShelfReport }, capture: { label: "Board before the camera", Form: CaptureForm, Main: CapturePage, Report: CaptureReport },
  rig: { label: "Rig", Form: RigForm, Main: RigPage, Report: RigReport },
  rolls: { label: "Rolling ball", Form: RollsForm, Main: RollsPage, Report: RollsReport }, scene: { label: "Scene in 3-D", Form: SceneForm, Main: ScenePage, Report: SceneReport },
  seeing: { label: "What it sees", Form: SeeingForm, Main: SeeingPage, Report: SeeingReport },
};

/** As a desk is described in main.js. Files dropped there are of nothing. */
export const pageDesk = () => (page.value ? { ...PAGES[page.value.name], standing: pageStanding, add: () => {} } : null);

/** The middle of the page. */
export const PageMiddle = () => (page.value ? html`<${PAGES[page.value.name].Main}/>` : null);
