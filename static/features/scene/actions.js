// Actions on a 3-D scene.
import { go, route } from "../../core/route.js";
import { version } from "../versions/versions.js";
import { changeView, firstScene, shownScene } from "./scene.js";

const atScene = () => route.value.view === "scene" && shownScene.value !== null && !shownScene.value.boards;

/** @type {import("../../core/actions.js").Action[]} */
export const SCENE_ACTIONS = [
  {
    id: "scene",
    label: "Show the scene in 3-D",
    short: "Scene in 3-D",
    group: "Pages",
    keys: ["F8"],
    run: () => go("scene", { scene: version.value?.id ?? firstScene.value }),
    enabled: () => route.value.view !== "scene",
  },
  {
    id: "scene-free",
    label: "Look at the scene freely",
    short: "Freely",
    group: "View",
    run: () => changeView({ view: "free" }),
    enabled: atScene,
  },
  {
    id: "scene-above",
    label: "Look at the scene from above",
    short: "From above",
    group: "View",
    run: () => changeView({ view: "above" }),
    enabled: atScene,
  },
];
