// Actions on camera models: compare them on the clicks, use the recommended one.
import { doc } from "../../core/document.js";
import { lensOpen } from "../../core/folds.js";
import { editing } from "../../core/state.js";
import { t } from "../../core/words.js";
import { preview } from "./fitting.js";
import {
  compareModels,
  comparison,
  ranking,
  stopComparing,
  useAutomaticModel,
  useModel,
} from "./model_ranking.js";

/** @type {import("../../core/actions.js").Action[]} */
export const MODEL_ACTIONS = [
  {
    id: "compare-models",
    label: t("calibrate.model-actions.compare"),
    short: t("calibrate.compare-models"),
    group: "model",
    run: compareModels,
    enabled: () => editing.value && preview.value !== null && comparison.value === null,
  },
  {
    id: "stop-comparing",
    label: t("calibrate.model-actions.stop"),
    short: t("common.stop"),
    group: "model",
    run: stopComparing,
    enabled: () => comparison.value !== null,
  },
  {
    id: "model-automatic",
    label: t("calibrate.model-actions.automatic"),
    short: t("calibrate.model-actions.automatic.short"),
    group: "model",
    run: useAutomaticModel,
    enabled: () => editing.value && doc.value.model !== null,
  },
  {
    id: "use-recommended",
    label: t("calibrate.model-actions.use-recommended"),
    keys: ["m"],
    group: "model",
    run: () => useModel(ranking.value?.recommended ?? ""),
    enabled: () => editing.value && lensOpen.value && Boolean(ranking.value?.recommended),
  },
];
