// A field that nobody has described: proposed on the server from the lines of an image, and opened as a new one.
import { computed, signal } from "@preact/signals";
import { call, toRefusal } from "../../core/api.js";
import { notify, snapshot } from "../../core/state.js";
import { t } from "../../core/words.js";
import { openAsNew } from "./editor.js";

export const proposing = signal(false);
const refused = signal(
  /** @type {{ of: string, why: import("../../core/types").Refusal } | null} */ (null),
);
/** Why none was proposed from the image that is shown. */
export const notProposed = computed(() =>
  refused.value?.of === snapshot.value?.id ? refused.value?.why : null,
);

/** @param {number} length between the goal lines, mm */
export async function proposeField(length) {
  const picture = snapshot.value?.id;
  if (!picture || proposing.value) return;
  proposing.value = true;
  refused.value = null;
  try {
    const { field, sentence } = await call("POST", "/fields/proposed", {
      snapshot: picture,
      length_mm: length,
    });
    if (snapshot.value?.id !== picture) return; // it was left
    await openAsNew({ ...field, name: "", title: "" }, picture);
    notify({ level: "info", text: sentence, fix: t("field-editor.proposed.fix"), about: "field/" });
  } catch (error) {
    refused.value = { of: picture, why: toRefusal(error) };
  } finally {
    proposing.value = false;
  }
}
