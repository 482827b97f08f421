// Actions on a 3-D scene.
import { page } from "../../core/page.js";
import { openPage } from "../shell/open_page.js";
import { version } from "../versions/versions.js";
import { changeView, firstScene, shownScene } from "./scene.js";

const atScene = () => page.value?.name === "scene" && shownScene.value !== null && !shownScene.value.boards;

/** @type {import("../../core/actions.js").Action[]} */
export const SCENE_ACTIONS = [
  {
    id: "scene",
    label: "Show the scene in 3-D",
    short: "Scene in 3-D",
    group: "Pages",
    keys: ["F8"],
    run: () => openPage("scene", version.value?.id ?? firstScene.value),
    enabled: () => page.value?.name !== "scene",
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
