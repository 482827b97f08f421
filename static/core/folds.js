// Which parts of the page are unfolded; a reload leaves them so.
import { computed, effect, signal } from "@preact/signals";

const KEPT = "touchline.unfolded";
/**
 * @typedef {"lens" | "distortion" | "residuals" | "landmarks" | "measured" | "field" | "inside" | "map" | "versions"
 * | "export" | "drift"} Fold
 */

const unfolded = signal(
  /** @type {Set<Fold>} */ (
    new Set((sessionStorage.getItem(KEPT) ?? "").split(" ").filter(Boolean))
  ),
);

/** @param {Fold} id */
export const isUnfolded = (id) => unfolded.value.has(id);
/** Whether the lens models and their options are, beside the points. */
export const lensOpen = computed(() => isUnfolded("lens"));

/** @param {Fold} id @param {boolean} [isOpen] */
export function unfold(id, isOpen = true) {
  if (unfolded.peek().has(id) === isOpen) return;
  const next = new Set(unfolded.peek());
  if (isOpen) next.add(id);
  else next.delete(id);
  unfolded.value = next;
}

effect(() => {
  const kept = [...unfolded.value].join(" ");
  try {
    sessionStorage.setItem(KEPT, kept);
  } catch {
    /* until the reload, then */
  }
});
