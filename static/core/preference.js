// What an operator switches on or off in this browser; on until it is switched off.
import { signal } from "@preact/signals";

/** A switch that the browser keeps. @param {string} key under which */
export function preference(key) {
  const it = signal(localStorage.getItem(key) !== "off");
  let isRead = false; // what was read need not be written
  it.subscribe((isOn) => {
    try {
      if (isRead) localStorage.setItem(key, isOn ? "on" : "off");
    } catch {
      /* until the reload, then */
    }
    isRead = true;
  });
  return it;
}
