// What the view that is shown has: left, in the middle, and on the right.
import { computed } from "@preact/signals";
import { VIEWS } from "../../../core/features.js";
import { html } from "../../../core/html.js";
import { addressOf, route } from "../../../core/route.js";
import { isNowhere } from "../../../core/state.js";
import { t } from "../../../core/words.js";

/** @type {import("../../../core/features.js").Shown} */
const NOWHERE = { addresses: [], label: t("shell.nowhere.title"), Main: NothingHere };

/** What is shown, or null while calibrating: that is the stage's.
 * @type {import("@preact/signals").ReadonlySignal<import("../../../core/features.js").Shown | null>} */
export const shown = computed(() => {
  const { view } = route.value;
  if (view === "nowhere" || isNowhere.value) return NOWHERE;
  if (view === "calibrate") return null;
  const it = VIEWS.get(view) ?? NOWHERE;
  return it.hasPanels?.value === false ? { ...it, Form: undefined, Report: undefined } : it;
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
