// htm bound to preact: html`<div/>` without a build step.
import { h } from "preact";
import htm from "htm";

const refuse = (/** @type {Event} */ event) => {
  event.preventDefault();
  event.stopPropagation();
};

/**
 * The properties of a button that cannot be used now. `disabled` would take the focus away from it, and the next key
 * would go to the page: Enter, pressed again after a refusal, would do the next step instead of what the button does.
 * @param {Record<string, any>} props
 */
const unusable = (props) => ({
  ...props,
  disabled: false,
  "aria-disabled": "true",
  tabindex: -1,
  onClick: refuse,
});

/** @param {any} type @param {Record<string, any> | null} props @param {any[]} children */
function element(type, props, ...children) {
  const isButton = type === "button" || (type === "input" && props?.type === "file");
  return h(type, isButton && props?.disabled ? unusable(props) : props, ...children);
}

export const html = htm.bind(element);
