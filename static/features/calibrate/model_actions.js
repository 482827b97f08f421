// Actions on camera models: compare them on the clicks, use the recommended one.
import { doc } from "../../core/document.js";
import { lensOpen } from "../../core/folds.js";
import { editing } from "../../core/state.js";
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
    label: "Compare the models on these clicks",
    short: "Compare the models",
    group: "Model",
    run: compareModels,
    enabled: () => editing.value && preview.value !== null && comparison.value === null,
  },
  {
    id: "stop-comparing",
    label: "Stop comparing the models",
    short: "Stop",
    group: "Model",
    run: stopComparing,
    enabled: () => comparison.value !== null,
  },
  {
    id: "model-automatic",
    label: "Let Touchline choose the lens model",
    short: "Automatic",
    group: "Model",
    run: useAutomaticModel,
    enabled: () => editing.value && doc.value.model !== null,
  },
  {
    id: "use-recommended",
    label: "Use the recommended model",
    keys: ["m"],
    group: "Model",
    run: () => useModel(ranking.value?.recommended ?? ""),
    enabled: () => editing.value && lensOpen.value && Boolean(ranking.value?.recommended),
  },
];
