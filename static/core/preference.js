// What an operator switches on or off in this browser; on until it is switched off.
import { signal } from "@preact/signals";

/** @param {string} key under which the browser keeps it */
export const preference = (key) => signal(localStorage.getItem(key) !== "off");

/** Switch it, and keep that. @param {import("@preact/signals").Signal<boolean>} it @param {string} key */
export function switchPreference(it, key, isOn = !it.value) {
  it.value = isOn;
  try {
    localStorage.setItem(key, isOn ? "on" : "off");
  } catch {
    /* until the reload, then */
  }
}
