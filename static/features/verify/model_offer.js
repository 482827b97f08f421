// A version with an automatic model is saved with the most probable lens, and the models are compared meanwhile: what
// came of it.
import { computed } from "@preact/signals";
import { comparing } from "../../core/state.js";
import { comparison, isFresh, ranking, useModel } from "../calibrate/model_ranking.js";
import { isUncompared, saveVersion, version } from "../versions/versions.js";

/** better: the model that the comparison recommends, where it is another one; mm: errors inside the field. */
export const offer = computed(() => {
  const saved = version.value?.model.name,
    is = comparing.value && isUncompared.value;
  const found = is && isFresh() ? ranking.value : null,
    mmOf = (/** @type {string} */ name) =>
      found?.ranking.find((r) => r.model === name)?.field_mm ?? null;
  const name = found?.recommended ?? null;
  return {
    isComparing: is && comparison.value !== null,
    better:
      name !== null && saved !== undefined && name !== saved
        ? { name, mm: mmOf(name), former: saved, former_mm: mmOf(saved) }
        : null,
  };
});

/** Save a version with it. */
export async function saveRecommended() {
  const { better } = offer.value;
  if (!better) return;
  useModel(better.name);
  await saveVersion();
}
