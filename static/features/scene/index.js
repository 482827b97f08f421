// Cameras, field and robots in space.
import { t } from "../../core/words.js";
import { SCENE_ACTIONS } from "./actions.js";
import { SceneForm, ScenePage, SceneReport } from "./panels/scene.js";
import { isNamed, sceneNextStep, startScene } from "./scene.js";

/** @type {import("../../core/features.js").Feature<"scene">} */
export const scene = {
  actions: SCENE_ACTIONS,
  start: [startScene],
  views: {
    scene: {
      addresses: ["field/scene/*scene", "field/scene"],
      label: t("common.scene"),
      Form: SceneForm,
      Main: ScenePage,
      Report: SceneReport,
      tabs: { field: 3 },
      tab: t("shell.tab.scene"),
      nextStep: sceneNextStep,
      hasPanels: isNamed,
    },
  },
};
