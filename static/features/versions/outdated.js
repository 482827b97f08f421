// Active versions that were made before their field was changed: made again from the points that they keep.
import { request } from "../../core/api.js";
import { lineName } from "../../core/format.js";
import { followJob } from "../../core/jobs.js";
import { longWork } from "../../core/long_work.js";
import { notify } from "../../core/state.js";
import { nameOr, t } from "../../core/words.js";
import { readCameras } from "../calibrate/pictures.js";
import { revision } from "./versions.js";

const NAMED = 3; // in a sentence

export const { search, refusal, watch } = longWork();

/** The field itself, an area, or a line, arc or landmark. @param {string} change */
const changeName = (change) =>
  change === "its size" ? t("versions.changes.size") : nameOr(`areas.${change}`, lineName(change));

/** What lies elsewhere now, in words. @param {string[]} changes */
export function changesInWords(changes) {
  const shown = changes.slice(0, NAMED).map(changeName),
    more = changes.length - shown.length;
  return more
    ? t("versions.changes-and-more", { changes: shown.join(", "), count: more })
    : shown.join(", ");
}

/**
 * Calibrate the cameras over a field again from their kept points, as new versions; none is activated.
 * @param {string} field
 * @param {string[] | null} cameras null: all that need it
 */
export async function calibrateAgain(field, cameras) {
  if (search.value) return;
  await watch(
    async (stop, onProgress) => {
      const started = await request("POST", `/fields/${encodeURIComponent(field)}/refit`, {
        json: { cameras },
      });
      return followJob(await started.json(), stop, onProgress);
    },
    async ({ calibrations }) => {
      revision.value += 1;
      notify({
        level: "info",
        text: t("versions.outdated.made", { count: calibrations.length }),
        fix: t("versions.outdated.made.fix"),
        about: `outdated/${field}`,
      });
      await readCameras();
    },
  );
}

export const stopCalibratingAgain = () => search.value?.stop.abort();
