// The manual beside the work: which page of it is open and at which heading, and what explains each panel.
import { signal } from "@preact/signals";
import { help } from "./state.js";
import { t } from "./words.js";

export const CONTENTS = "contents.md";

/**
 * heading: as in the address of a heading, "" the top. asked: counts, so that the same place can be asked for twice.
 */
export const manualPage = signal({ name: "", text: "", heading: "", asked: 0 });

/** What explains a panel: page#heading. A test looks up every one of them. @type {Record<string, string>} */
export const EXPLAINED = {
  "without-clicks": "automatic.md",
  "robot-heights": "referee.md",
  check: "checking.md",
  checks: "calibrating.md#verify-and-activate",
  tracks: "detection.md#tracks-of-a-rig",
  field: "calibrating.md",
  drawing: "conventions.md#the-field",
  "own-field": "fields.md",
  borders: "points.md",
  inside: "points.md#reading-the-results",
  degree: "points.md#curve-degree",
  verdict: "numbers.md#verdict",
  warnings: "warnings.md",
  distortion: "numbers.md#distortion",
  residuals: "numbers.md#residual",
  models: "models.md",
  options: "models.md",
  compare: "numbers.md#expected-error",
  map: "numbers.md#expected-error",
  versions: "saved-data.md",
  downloads: "formats.md",
  live: "live.md",
  drift: "drift.md",
  reregister: "drift.md#updating-the-camera-pose",
  light: "light.md",
  controls: "cameras.md#settings-while-running",
  board: "boards.md",
  lens: "boards.md",
  straight: "straight.md",
  edges: "straight.md#results-and-their-limits",
  network: "league.md",
  matches: "rigs.md#matched-points",
  wrong: "troubleshooting.md",
  scene: "scene.md",
  seen: "detection.md#detection-tab",
  colours: "detection-colours.md",
  "colour-presets": "detection-colours.md#saving-and-sharing-colours",
  stages: "detection.md#tuning-the-stages",
  "seen-published": "detection.md#publishing-detections",
  rolls: "rolling-ball.md",
  "rolls-all": "rolling-ball.md#limits",
};

/** The end of a heading's address: "Reading the results" → "reading-the-results". @param {string} text */
export const slug = (text) =>
  text
    .toLowerCase()
    .replace(/[^\p{L}\p{N}]+/gu, "-")
    .replace(/^-|-$/g, "");

/** Pages that were renamed. @type {Record<string, string>} */
const FORMER_PAGES = {
  "automatic-detection": "automatic.md",
  reports: "report.md",
  "ssl-vision": "league.md",
  "straight-edges": "straight.md",
};

let newest = 0; // of what was asked for: the last one wins, whichever answer comes first

/** Whether nobody has asked for a page yet. */
export const isUnread = () => newest === 0;

/** Open a page, "models.md" or "models.md#division", beside the work. @param {string} to */
export async function openManual(to) {
  const [page, heading = ""] = to.split("#"),
    name = FORMER_PAGES[page.replace(/\.md$/, "")] ?? page,
    asked = ++newest;
  help.value = "manual";
  if (name === manualPage.value.name) {
    manualPage.value = { ...manualPage.value, heading, asked };
    return;
  }
  let text;
  try {
    const response = await fetch(`help/${name}`);
    text = response.ok ? await response.text() : t("core.manual.no-page", { name });
  } catch {
    text = t("core.manual.unreachable");
  }
  if (asked === newest) manualPage.value = { name, text, heading, asked };
}
