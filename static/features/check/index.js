// The active calibration checked in a camera's present picture.
import { t } from "../../core/words.js";
import { CHECK_ACTIONS } from "./check.js";

/** @type {import("../../core/features.js").Feature} */
export const check = { actions: CHECK_ACTIONS, jobs: { check: t("jobs.kind.check") } };
