// A part of the page that is loaded when it is first drawn: the page itself is there sooner.
import { signal } from "@preact/signals";
import { html } from "../core/html.js";
import { notify, retract } from "../core/state.js";
import { t } from "../core/words.js";

const ABOUT = "ui/later"; // one notice for all of them

/**
 * Return a component that loads itself. Until then, waiting is drawn in its place; without the server it is tried again
 * the next time that it is drawn.
 * @param {() => Promise<any>} load
 * @param {(props: any) => any} [waiting]
 */
export function later(load, waiting = () => null) {
  const part = signal(/** @type {any} */ (null));
  let isLoading = false;
  const begin = async () => {
    isLoading = true;
    try {
      part.value = await load();
      retract(ABOUT);
    } catch {
      notify({ level: "warn", text: t("ui.later"), fix: t("ui.later.fix"), about: ABOUT });
    }
    isLoading = false;
  };
  return (/** @type {any} */ props) => {
    if (part.value) return html`<${part.value} ...${props} />`;
    if (!isLoading) void begin();
    return waiting(props);
  };
}
