// Detecting the field's lines, by itself or when asked.
import { t } from "../../core/words.js";
import { FIND_LINES_ACTIONS, startDetecting } from "./find_lines.js";

/** @type {import("../../core/features.js").Feature} */
export const automatic = {
  actions: FIND_LINES_ACTIONS,
  start: [startDetecting],
  jobs: { auto: t("jobs.kind.auto") },
};
