// Every model on the same clicks: asked for while the operator chooses one.
import { effect, signal, untracked } from "@preact/signals";
import { call } from "./api.js";
import { doc, dragging } from "./document.js";
import { fitBody, preview, stale } from "./fitting.js";
import { newestWins } from "./newest.js";
import { step } from "./state.js";

const PAUSE_MS = 400; // six fits and their cross-validation are not asked for at pointer rate

/** The models, best first, for the clicks in `of`. */
export const ranking = signal(/** @type {(import("./types").Ranking & { of: string }) | null} */ (null));

/** What a ranking depends on: the clicks and the field, not the model that is chosen. */
const clicks = () => {
  const { model: _model, options: _options, ...others } = fitBody(doc.value);
  return others;
};

const ask = newestWins(async (/** @type {ReturnType<typeof clicks>} */ body) => {
  try {
    ranking.value = { ...(await call("POST", "/calibrations/compare", body)), of: JSON.stringify(body) };
  } catch { ranking.value = null; } // the verdict already says what is missing
});

/** Keep the ranking up to date while the model step is open, from now on. */
export function startRanking() {
  let timer = 0;
  effect(() => {
    const isWanted = step.value === "model" && preview.value !== null && !stale.value && !dragging.value;
    void doc.value;
    clearTimeout(timer);
    untracked(() => {
      const body = clicks();
      if (isWanted && ranking.value?.of !== JSON.stringify(body)) timer = setTimeout(() => void ask(body), PAUSE_MS);
    });
  });
}
