// Starts the page: registers the features, draws, then starts what listens, saves and asks the server.
import { effect } from "@preact/signals";
import { render } from "preact";
import { registerFeatures } from "./core/features.js";
import { html } from "./core/html.js";
import { startKeys } from "./core/keys.js";
import { FEATURES } from "./features/index.js";
import { loadLists } from "./features/calibrate/pictures.js";
import { App, title } from "./features/shell/panels/app.js";

async function start() {
  registerFeatures(FEATURES);
  effect(() => {
    document.title = title.value;
  });
  render(html`<${App} />`, /** @type {HTMLElement} */ (document.getElementById("app")));
  startKeys();
  for (const it of FEATURES) for (const begin of it.start ?? []) begin();
  await loadLists();
}

void start();
