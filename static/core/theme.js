// Dark, light, or as the system has it: the operator's choice, kept in this browser.
import { effect, signal } from "@preact/signals";
import { t } from "./words.js";

/** @typedef {"system" | "dark" | "light"} Theme */

const KEPT = "touchline-theme"; // index.html reads it before the first paint

/** @type {[Theme, string][]} */
export const THEMES = [
  ["system", t("core.theme.system")],
  ["dark", t("core.theme.dark")],
  ["light", t("core.theme.light")],
];

export const theme = signal(
  /** @type {Theme} */ (
    THEMES.find(([id]) => id === document.documentElement.dataset.theme)?.[0] ?? "system"
  ),
);

effect(() => {
  document.documentElement.dataset.theme = theme.value;
});

/** @param {Theme} to */
export function chooseTheme(to) {
  theme.value = to;
  try {
    localStorage.setItem(KEPT, to);
  } catch {
    /* private windows keep nothing: until the reload, then */
  }
}

// Another tab's choice is this one's too.
addEventListener("storage", ({ key, newValue }) => {
  if (key === KEPT) theme.value = THEMES.find(([id]) => id === newValue)?.[0] ?? "system";
});
