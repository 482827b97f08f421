// Where the operator stands on a page beside the steps, by its name; panels/pages.js draws them.
import { computed } from "@preact/signals";
import { page } from "../../core/page.js";
import { captureStanding } from "../board/capture.js";
import { seeingStanding } from "../detection/detection.js";
import { jobsStanding } from "../jobs/job_list.js";
import { rigStanding } from "../rig/rig.js";
import { rollsStanding } from "../rolling/rolls.js";
import { sceneStanding } from "../scene/scene.js";
import { settingsStanding } from "../settings/settings.js";
import { shelfStanding } from "../versions/version_list.js";

const STANDINGS = { jobs: jobsStanding, settings: settingsStanding, versions: shelfStanding, capture: captureStanding, rig: rigStanding, rolls: rollsStanding, scene: sceneStanding, seeing: seeingStanding };

export const pageStanding = computed(() => STANDINGS[page.value?.name ?? "jobs"].value);
