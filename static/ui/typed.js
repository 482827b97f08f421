// An input that keeps what is being typed while its panel is drawn again.
import { useRef, useState } from "preact/hooks";
import { html } from "../core/html.js";

/**
 * An input whose text is its own from the first key until it is taken, and what stands otherwise.
 * `take` gets the text when it is done (Enter, Tab, a click elsewhere); its promise, where it gives one, holds the text
 * until the answer is there.
 * @param {{ value: string | number, take: (text: string) => unknown, [attribute: string]: unknown }} props
 */
export function Typed({ value, take, ...about }) {
  const [typed, setTyped] = useState(/** @type {string | null} */ (null));
  const taking = useRef(0);
  /** @param {{ target: HTMLInputElement }} event */
  const done = async ({ target: { value: text } }) => {
    taking.current += 1;
    try {
      await take(text);
    } finally {
      taking.current -= 1;
      setTyped((now) => (now === text ? null : now)); // more was typed meanwhile: that stays
    }
  };
  return html`<input
    ...${about}
    value=${typed ?? value}
    onInput=${(/** @type {{ target: HTMLInputElement }} */ e) => setTyped(e.target.value)}
    onChange=${done}
    onBlur=${() => {
      if (!taking.current) setTyped(null);
    }}
  />`;
}
