// Calibrating one picture, at the stage. Its parts are apart in the list of features, since their keys are others' too.
import { t } from "../../core/words.js";
import { startSaving } from "./draft.js";
import { startFitting } from "./fitting.js";
import { startLineSuggestions } from "./line_suggestions.js";
import { MODEL_ACTIONS } from "./model_actions.js";
import { startRanking } from "./model_ranking.js";
import { FIELD_ACTIONS, PICTURE_ACTIONS } from "./picture_actions.js";
import { startPictures } from "./pictures.js";
import { HISTORY_ACTIONS, POINT_ACTIONS } from "./point_actions.js";
import { startPresence } from "./presence.js";
import { startHovering } from "./residuals.js";
import { SNAP_ACTIONS } from "./snap_actions.js";
import { startSnapping } from "./snapping.js";
import { VIEW_ACTIONS } from "./view_actions.js";

/**
 * @typedef {import("../../core/features.js").Feature<"calibrate">} Pictures
 * @typedef {import("../../core/features.js").Feature} Part
 * @type {{ pictures: Pictures, field: Part, points: Part, history: Part, models: Part }}
 */
export const calibrate = {
  pictures: {
    actions: PICTURE_ACTIONS,
    start: [
      startPictures,
      startFitting,
      startSaving,
      startSnapping,
      startLineSuggestions,
      startRanking,
      startHovering,
      startPresence,
    ],
    views: {
      calibrate: { addresses: ["calibrate/:picture/:step"], label: t("shell.view.camera-images") },
    },
    jobs: {
      calibration: t("jobs.kind.calibration"),
      preview: t("jobs.kind.preview"),
      comparison: t("jobs.kind.comparison"),
    },
  },
  field: { actions: FIELD_ACTIONS },
  points: { actions: [...POINT_ACTIONS, ...SNAP_ACTIONS] },
  history: { actions: [...HISTORY_ACTIONS, ...VIEW_ACTIONS] },
  models: { actions: MODEL_ACTIONS },
};
