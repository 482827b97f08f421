// The one question that an accuracy may depend on: from straight above, height and focal length look the same.
import { computed } from "@preact/signals";
import { doc } from "../../core/document.js";
import { model } from "../../core/state.js";
import { preview } from "./fitting.js";

const HEIGHT = "height_mm",
  UNKNOWN = "height-unknown"; // the warning of a fit

/** @param {import("../../core/types").Report} report */
export const isHeightUnknown = (report) => report.warnings.some((w) => w.reason === UNKNOWN);

/** The option to ask for beside the accuracy: where the fit wants it, or it was given; else null. */
export const askedHeight = computed(() => {
  const isWanted = preview.value !== null && isHeightUnknown(preview.value.report),
    isGiven = HEIGHT in doc.value.options;
  return ((isWanted || isGiven) && model.value?.options.find((o) => o.name === HEIGHT)) || null;
});
