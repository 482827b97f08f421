// Where the operator stands on a page beside the steps, by its name; panels/pages.js draws them.
import { computed } from "@preact/signals";
import { jobsStanding } from "./all_jobs.js";
import { captureStanding } from "./capture.js";
import { page } from "./page.js";
import { rigStanding } from "./rig.js";
import { rollsStanding } from "./rolls.js";
import { sceneStanding } from "./scene.js";
import { seeingStanding } from "./seeing.js";
import { settingsStanding } from "./settings.js";
import { shelfStanding } from "./version_shelf.js";

const STANDINGS = { jobs: jobsStanding, settings: settingsStanding, versions: shelfStanding, capture: captureStanding, rig: rigStanding, rolls: rollsStanding, scene: sceneStanding, seeing: seeingStanding };

export const pageStanding = computed(() => STANDINGS[page.value?.name ?? "jobs"].value);
