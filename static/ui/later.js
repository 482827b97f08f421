// A part of the page that is loaded when it is first drawn: the page itself is there sooner.
import { signal } from "@preact/signals";
import { html } from "../core/html.js";
import { notifyError } from "../core/state.js";

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
    } catch (error) {
      notifyError(error);
    }
    isLoading = false;
  };
  return (/** @type {any} */ props) => {
    if (part.value) return html`<${part.value} ...${props} />`;
    if (!isLoading) void begin();
    return waiting(props);
  };
}
