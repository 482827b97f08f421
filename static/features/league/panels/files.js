// What is published as a file for another program, which then publishes it in our place.
import { signal } from "@preact/signals";
import { address } from "../../../core/api.js";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { changing, ofShownRig, updateSslVisionSettings } from "../network.js";

/** What was replaced in the newest file, and what not. */
const notes = signal(/** @type {{ text: string }[]} */ ([]));

/** @param {File} file */
async function update(file) {
  notes.value = [];
  const found = await updateSslVisionSettings(file);
  if (!found) return;
  notes.value = found.notes;
  const url = URL.createObjectURL(new Blob([found.content], { type: "application/xml" }));
  Object.assign(document.createElement("a"), { href: url, download: file.name }).click();
  setTimeout(() => URL.revokeObjectURL(url)); // once the browser has begun to save it
}

export const ProgramFiles = () => html`<details class="more" data-testid="program-files">
  <summary>${t("network.files")}</summary>
  <p class="reason">${t("network.files.about")}</p>
  <div class="line wrap">
    <a class="as-button" href=${address(ofShownRig("/publishing/geometry.yml"))} download="touchline.geometry.yml">
      ${t("network.files.geometry")}
    </a>
    <label class="as-button" title=${t("network.files.settings.hint")}>
      ${t("network.files.settings")}
      <input
        type="file"
        class="sr"
        data-testid="ssl-vision-settings"
        accept=".xml"
        disabled=${changing.value}
        onChange=${(/** @type {{ target: HTMLInputElement }} */ { target }) => {
          const file = target.files?.[0];
          target.value = "";
          if (file) void update(file);
        }}
      />
    </label>
  </div>
  ${
    notes.value.length > 0 &&
    html`<ul class="plain" role="status" data-testid="ssl-vision-notes">
    ${notes.value.map(({ text }) => html`<li key=${text}>${text}</li>`)}
  </ul>`
  }
</details>`;
