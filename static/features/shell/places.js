// The five places of the rail, and the tabs within each.
import { computed } from "@preact/signals";
import { VIEWS } from "../../core/features.js";
import { addressOf, route } from "../../core/route.js";
import { cameras, namedCamera } from "../../core/state.js";
import { t } from "../../core/words.js";

/**
 * @typedef {import("../../core/route.js").View} View
 * @typedef {import("../../core/route.js").Place} Place
 */

/** icon: a path on 24 × 24. @type {{ place: Place, view: View, label: string, icon: string }[]} */
export const PLACES = [
  {
    place: "cameras",
    view: "wall",
    label: t("shell.place.cameras"),
    icon: "M4 7h10v10H4zM14 11l6-3v8l-6-3",
  },
  {
    place: "field",
    view: "field",
    label: t("shell.place.field"),
    icon: "M3 6h18v12H3zM12 6v12M9.5 12a2.5 2.5 0 0 0 5 0a2.5 2.5 0 0 0-5 0",
  },
  {
    place: "lenses",
    view: "lenses",
    label: t("shell.place.lenses"),
    icon: "M4 12a8 8 0 0 0 16 0a8 8 0 0 0-16 0M8.5 12a3.5 3.5 0 0 0 7 0a3.5 3.5 0 0 0-7 0",
  },
  {
    place: "library",
    view: "images",
    label: t("shell.place.library"),
    icon: "M4 7h16M4 12h16M4 17h10",
  },
  {
    place: "system",
    view: "publishing",
    label: t("shell.place.system"),
    icon:
      "M9 12a3 3 0 0 0 6 0a3 3 0 0 0-6 0M12 4v2M12 18v2M4 12h2M18 12h2M6.3 6.3l1.5 1.5M16.2 16.2l1.5 1.5" +
      "M17.7 6.3l-1.5 1.5M7.8 16.2l-1.5 1.5",
  },
];

/** The tabs of a place by their rank, as views and labels; at the place of the cameras, those of each one.
 * @param {Place} place @returns {[View, string][]} */
export const tabsOf = (place) =>
  [...VIEWS]
    .filter(([, it]) => it.tabs?.[place])
    .toSorted(([, a], [, b]) => Number(a.tabs?.[place]) - Number(b.tabs?.[place]))
    .map(([view, it]) => [/** @type {View} */ (view), it.tab ?? it.label]);

/** The tabs beside the view that is shown, each with its address. */
export const tabs = computed(() => {
  const { view, place } = route.value,
    camera = namedCamera.value?.id ?? "",
    isCamera = place === "cameras" && camera !== "",
    shown = VIEWS.get(view)?.behind ?? view;
  if (place === "cameras" && !isCamera) return [];
  return tabsOf(place).flatMap(([id, label]) => {
    const of = id === "ball" && !camera ? (cameras.value[0]?.id ?? "") : camera;
    if (id === "ball" && !of) return []; // it rolls before a camera
    const words = isCamera || id === "ball" ? { camera: of } : {};
    return [{ view: id, label, href: addressOf(id, words), isShown: id === shown }];
  });
});
