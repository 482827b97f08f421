// Colours of a camera: which one is being learned, its samples, how well it is separated from the others, and presets.
import { useState } from "preact/hooks";
import { run } from "../../../core/actions.js";
import { number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { keyLabel } from "../../../core/keys.js";
import { cameras } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { rich } from "../../../ui/rich.js";
import { Title } from "../../../ui/title.js";
import {
  BACKGROUND,
  COLOURS,
  colour,
  copyTo,
  forget,
  forgetAll,
  learning,
  neededColours,
  notes,
  overwriteCandidate,
  presetName,
  presets,
  removePreset,
  savePreset,
  usePreset,
  colourName,
} from "../colours.js";
import { detectionCamera, detectionState } from "../detection.js";

const LEVELS = { good: "good", close: "fair", mixed: "poor" };

export function DetectionForm() {
  const it = detectionState.value;
  if (!detectionCamera.value || !it) return null;
  const first = COLOURS.filter(([name]) => neededColours.value.has(name) || name === BACKGROUND),
    others = COLOURS.filter(([name]) => !neededColours.value.has(name) && name !== BACKGROUND);
  return html`
    <section aria-label=${t("detection.colours.title")} data-testid="colours">
      <${Title} of="colours">${t("detection.colours.title")}<//>
      <p class="reason" data-testid="learned">
        ${
          it.learned === "clicks"
            ? rich("detection.colours.gone-by", { profile: it.profile?.name })
            : it.learned === "picture"
              ? t("detection.colours.found")
              : t("detection.colours.not-found")
        }
      </p>
      <ul class="colours">
        ${first.map((one) => html`<${Colour} key=${one[0]} of=${one} />`)}
      </ul>
      ${
        others.length > 0 &&
        html`<details class="more">
        <summary data-testid="more-colours">${t("detection.colours.more")}</summary>
        <ul class="colours">
          ${others.map((one) => html`<${Colour} key=${one[0]} of=${one} />`)}
        </ul>
      </details>`
      }
      ${
        learning.value &&
        html`<div class="working" data-testid="learning">
        <div class="line">
          <progress aria-label=${learning.value.what}></progress>
          <${ActionButton} id="stop-learning" />
        </div>
        <p class="reason">${learning.value.what}…</p>
      </div>`
      }
      ${notes.value.map(
        (note) => html`<p key=${note} class="reason">
        ${note}
      </p>`,
      )}
      <div class="line wrap">
        <${ActionButton} id="find-colours" />
        ${
          it.learned === "clicks" &&
          html`<button type="button" data-testid="forget-colours" onClick=${() => void forgetAll()}>
            ${t("detection.colours.forget-all")}
          </button>`
        }
      </div>
    </section>
    <${Presets} />
  `;
}

/** The same colours below the picture, where the panel is far from it: on a telephone. */
export const Palette =
  () => html`<div class="palette" role="group" aria-label=${t("detection.colours.teach")}>
  ${COLOURS.filter(([name]) => neededColours.value.has(name) || name === BACKGROUND).map(
    ([name, paint]) =>
      html`<button
      key=${name}
      type="button"
      aria-pressed=${String(colour.value === name)}
      aria-label=${t("detection.colours.teach-one", { colour: colourName(name) })}
      onClick=${() => run(`colour-${name}`)}
    >
      <i class="chip" style=${`--colour:${paint}`} aria-hidden="true"></i>
    </button>`,
  )}
</div>`;

/** One colour: chosen by a click, its samples to be taken away. @param {{ of: [string, string] }} props */
function Colour({ of: [name, paint] }) {
  const it = detectionState.value?.profile,
    samples = (name === BACKGROUND ? it?.background : it?.colours[name]) ?? [],
    health = detectionState.value?.health.find((h) => h.colour === name);
  const place = COLOURS.findIndex(([one]) => one === name) + 1,
    isBackground = name === BACKGROUND;
  return html`<li data-testid=${`colour-row-${name}`} data-level=${health?.level ?? ""}>
    <button
      type="button"
      class="feature"
      data-testid=${`colour-${name}`}
      aria-pressed=${String(colour.value === name)}
      aria-keyshortcuts=${String(place)}
      title=${t("detection.colours.teach-by-key", { colour: colourName(name), key: place })}
      onClick=${() => run(`colour-${name}`)}
    >
      <i class="chip" style=${`--colour:${paint}`} aria-hidden="true"></i>
      <span>${colourName(name)}</span>
      <small>
        ${
          isBackground && !samples.length
            ? t("detection.colours.by-itself")
            : t("detection.colours.samples", { count: samples.length })
        }
      </small>
      <kbd aria-hidden="true" data-key=${keyLabel(String(place))}></kbd>
    </button>
    ${
      samples.length > 0 &&
      (!isBackground || colour.value === name) &&
      html`<span class="samples">
      ${samples.map(
        (s, i) => html`<button
        key=${i}
        type="button"
        class="sample"
        data-testid=${`sample-${name}`}
        style=${`--colour:rgb(${s.rgb.join()})`}
        aria-label=${t("detection.colours.remove-sample", { number: i + 1, colour: colourName(name) })}
        title=${t("detection.colours.remove-this")}
        onClick=${() => forget(name, i)}
      >
        ×
      </button>`,
      )}
    </span>`
    }
    ${
      health &&
      html`<p class="reason" data-testid=${`health-${name}`}>
      <b class=${`level ${LEVELS[health.level]}`}>
        ${t(`detection.colours.level.${health.level}`)}
      </b>
      ${health.margin === null ? "" : t("detection.colours.margin", { margin: number(health.margin, 1) })}.${" "}
      ${health.level === "good" ? "" : health.words}
    </p>`
    }
    ${
      isBackground &&
      colour.value === name &&
      html`<p class="reason">
      ${t("detection.colours.background")}
    </p>`
    }
  </li>`;
}

/** Kept for a venue, by name; and copied to another camera. */
function Presets() {
  const it = detectionState.value,
    [typed, setTyped] = useState(""),
    name = presetName(typed),
    others = cameras.value.filter((c) => c.id !== it?.camera),
    [to, setTo] = useState("");
  if (!it) return null;
  const isShared = it.colours !== null && it.profile?.name === it.colours,
    target = others.find((c) => c.id === to)?.id ?? others[0]?.id,
    used = presets.value.find((p) => p.name === it.colours);
  return html`<section aria-label=${t("detection.presets.section")}>
    <${Title} of="colour-presets">${t("detection.presets.title")}<//>
    <label class="pair tall">
      <span>${t("detection.presets.go-by")}</span>
      <select
        data-testid="preset"
        value=${isShared ? it.colours : ""}
        onChange=${(/** @type {any} */ e) => {
          if (e.target.value) void usePreset(e.target.value);
        }}
      >
        <option value="">
          ${
            isShared
              ? t("detection.choose")
              : it.learned === "clicks"
                ? t("detection.presets.own")
                : t("detection.presets.found")
          }
        </option>
        ${presets.value.map(
          (p) => html`<option key=${p.name} value=${p.name}>
          ${p.name}
        </option>`,
        )}
      </select>
    </label>
    ${
      isShared &&
      used &&
      used.used_by.length > 1 &&
      html`<p class="reason">
      ${t("detection.presets.shared", { cameras: used.used_by.join(", ") })}
    </p>`
    }
    <label class="pair tall">
      <span>${t("detection.presets.keep-as")}</span>
      <input
        type="text"
        data-testid="preset-name"
        maxlength="64"
        placeholder=${t("detection.presets.example")}
        value=${typed}
        onInput=${(/** @type {any} */ e) => setTyped(e.target.value)}
      />
    </label>
    <div class="line wrap">
      <button
        type="button"
        data-testid="save-preset"
        disabled=${!name || !it.profile}
        onClick=${() => void savePreset(name)}
      >
        ${
          overwriteCandidate.value === name && name
            ? t("detection.presets.save-over", { preset: name })
            : t("detection.presets.keep")
        }
      </button>
      ${
        isShared &&
        it.colours &&
        html`<button
        type="button"
        data-testid="remove-preset"
        disabled=${(used?.used_by.length ?? 1) > 0}
        title=${
          (used?.used_by.length ?? 1) > 0
            ? t("detection.presets.in-use")
            : t("detection.presets.remove")
        }
        onClick=${() => void removePreset(it.colours ?? "")}
      >
        ${t("detection.presets.remove-named", { preset: it.colours })}
      </button>`
      }
    </div>
    ${
      others.length > 0 &&
      html`<div class="line wrap copy">
      <label class="pair tall grow">
        <span>${t("detection.presets.copy-to")}</span>
        <select
          data-testid="copy-to"
          value=${target}
          onChange=${(/** @type {any} */ e) => setTo(e.target.value)}
        >
          ${others.map(
            (c) => html`<option key=${c.id} value=${c.id}>
            ${c.name}
          </option>`,
          )}
        </select>
      </label>
      <button
        type="button"
        data-testid="copy-colours"
        disabled=${!it.profile}
        onClick=${() => {
          if (target) void copyTo(target);
        }}
      >
        ${t("detection.presets.copy")}
      </button>
    </div>`
    }
  </section>`;
}
