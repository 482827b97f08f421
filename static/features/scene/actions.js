// Actions on a 3-D scene.
import { go, route } from "../../core/route.js";
import { t } from "../../core/words.js";
import { version } from "../versions/versions.js";
import { changeView, shownScene } from "./scene.js";

const atScene = () =>
  route.value.view === "scene" && shownScene.value !== null && !shownScene.value.boards;

/** @type {import("../../core/actions.js").Action[]} */
export const SCENE_ACTIONS = [
  {
    id: "scene",
    label: t("scene.action.show"),
    short: t("common.scene"),
    group: "pages",
    keys: ["F8"],
    run: () => go("scene", { scene: version.value?.id ?? "" }),
    enabled: () => route.value.view !== "scene",
  },
  {
    id: "scene-free",
    label: t("scene.action.free"),
    short: t("scene.action.free.short"),
    group: "view",
    run: () => changeView({ view: "free" }),
    enabled: atScene,
  },
  {
    id: "scene-above",
    label: t("scene.action.above"),
    short: t("scene.action.above.short"),
    group: "view",
    run: () => changeView({ view: "above" }),
    enabled: atScene,
  },
];
