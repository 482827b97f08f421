// Actions that go to a place.
import { go } from "../../core/route.js";
import { cameras, snapshot } from "../../core/state.js";
import { openPalette } from "./palette.js";
import { PLACES } from "./places.js";
import { badCamera } from "./problems.js";

/** @type {import("../../core/actions.js").Action[]} */
export const PAGE_ACTIONS = [
  { id: "palette", label: "Search, or run a command", keys: ["ctrl+k"], group: "Places", run: openPalette },
  ...PLACES.map(({ place, view, label }) => ({
    id: `go-${place}`,
    label: `Go to ${label}`,
    group: "Places",
    run: () => go(view),
  })),
  {
    id: "fix-camera",
    label: "Show the camera that needs attention",
    group: "Places",
    enabled: () => badCamera.value !== null,
    run: () => {
      location.hash = badCamera.value?.href ?? "";
    },
  },
  { id: "jobs", label: "Show the jobs", keys: ["i"], group: "Places", run: () => go("jobs") },
  {
    id: "versions",
    label: "Show all saved versions",
    keys: ["y"],
    group: "Places",
    run: () => go("versions", { camera: snapshot.value?.camera ?? cameras.value[0]?.id }),
  },
  { id: "settings", label: "Show the server's settings", group: "Places", run: () => go("server") },
];
