// The next step of each view beside calibrating and the wall.
import { computed } from "@preact/signals";
import { VIEWS } from "../../core/features.js";
import { route } from "../../core/route.js";
import { isNowhere } from "../../core/state.js";
import { t } from "../../core/words.js";

const nowhereNextStep = computed(() => ({
  action: "step-camera",
  label: t("shell.back-to-cameras"),
  missing: "",
  done: false,
  sentence: t("shell.nowhere.sentence"),
}));

/** Of the view that is shown; null where there is none, on the wall, and while calibrating. */
export const viewNextStep = computed(() => {
  const { view } = route.value;
  if (view === "nowhere" || isNowhere.value) return nowhereNextStep.value;
  return VIEWS.get(view)?.nextStep?.value ?? null;
});
