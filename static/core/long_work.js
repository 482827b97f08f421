// Long work as a panel shows it: how far it is, the way to stop it, and why it was refused.
import { signal } from "@preact/signals";
import { ServerUnreachable, toRefusal } from "./api.js";
import { Stopped } from "./jobs.js";
import { t } from "./words.js";

/** Track one piece of work. */
export function longWork() {
  const search = signal(
    /** @type {{ progress: number, message: string, stop: AbortController } | null} */ (null),
  );
  const refusal = signal(/** @type {import("./types").Refusal | null} */ (null));
  /**
   * @param {(stop: AbortSignal, onProgress: (job: import("./types").Job) => void) => Promise<any>} work
   * @param {(result: any) => unknown} done
   */
  async function watch(work, done) {
    const stop = new AbortController();
    search.value = { progress: 0, message: "", stop };
    refusal.value = null;
    try {
      await done(
        await work(stop.signal, ({ progress, message }) => {
          search.value = { progress, message, stop };
        }),
      );
    } catch (error) {
      if (!(error instanceof Stopped))
        refusal.value =
          error instanceof ServerUnreachable
            ? { detail: error.message, fix: t("common.try-later") }
            : toRefusal(error);
    } finally {
      search.value = null;
    }
  }
  return { search, refusal, watch };
}
