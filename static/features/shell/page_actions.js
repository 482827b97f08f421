// Actions that go to a place.
import { go } from "../../core/route.js";
import { cameras, snapshot } from "../../core/state.js";
import { t } from "../../core/words.js";
import { openPalette } from "./palette.js";
import { PLACES } from "./places.js";
import { badCamera } from "./problems.js";

/** @type {import("../../core/actions.js").Action[]} */
export const PAGE_ACTIONS = [
  {
    id: "palette",
    label: t("shell.action.palette"),
    keys: ["ctrl+k"],
    group: "places",
    run: openPalette,
  },
  ...PLACES.map(({ place, view, label }) => ({
    id: `go-${place}`,
    label: t("shell.action.go-to-place", { place: label }),
    group: /** @type {const} */ ("places"),
    run: () => go(view),
  })),
  {
    id: "fix-camera",
    label: t("shell.action.fix-camera"),
    group: "places",
    enabled: () => badCamera.value !== null,
    run: () => {
      location.hash = badCamera.value?.href ?? "";
    },
  },
  {
    id: "jobs",
    label: t("shell.action.jobs"),
    keys: ["i"],
    group: "places",
    run: () => go("jobs"),
  },
  {
    id: "versions",
    label: t("shell.action.versions"),
    keys: ["y"],
    group: "places",
    run: () => go("versions", { camera: snapshot.value?.camera ?? cameras.value[0]?.id }),
  },
  {
    id: "settings",
    label: t("shell.action.settings"),
    group: "places",
    run: () => go("server"),
  },
];
