// Below the picture: hold a frame, record a clip, choose one, step and play.
import { dayAndTime, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { clips, openClip, playing, recording, removeClip, seek } from "../clips.js";
import { heldFrame } from "../held_frame.js";

export function ClipBar() {
  const it = heldFrame.value,
    clip = it?.clip ?? null;
  return html`<div class="clips" data-testid="clips">
    <div class="line wrap">
      <${ActionButton}
        id="hold-frame"
        label=${it ? t("detection.clips.go-on") : t("detection.action.hold-frame.short")}
      />
      <${ActionButton} id="next-frame" />
      ${
        clip &&
        html`
        <${ActionButton} id="previous-frame" />
        <${ActionButton}
          id="play-clip"
          label=${playing.value ? t("detection.clips.pause") : t("detection.action.play-clip.short")}
        />
      `
      }
      <${ActionButton} id="record-clip" />
      ${
        clips.value.length > 0 &&
        html`<label class="line plan">
        ${t("detection.clips.clip")}${" "}
        <select
          data-testid="clip"
          value=${clip?.clip ?? ""}
          onChange=${(/** @type {any} */ e) => openClip(e.target.value)}
        >
          <option value="">${clip ? t("detection.clips.back") : t("detection.choose")}</option>
          ${clips.value.map(
            (c) => html`<option key=${c.clip} value=${c.clip}>
            ${t("detection.clips.option", {
              time: dayAndTime(c.taken_at),
              seconds: number(c.seconds, 1),
              count: c.frames,
            })}
          </option>`,
          )}
        </select>
      </label>`
      }
      ${
        clip &&
        html`<button type="button" data-testid="remove-clip" onClick=${() => void removeClip(clip)}>
        ${t("detection.clips.remove")}
      </button>`
      }
    </div>
    ${
      recording.value &&
      html`<div class="working" data-testid="recording">
      <div class="line">
        <progress max="1" value=${recording.value.share} aria-label=${t("detection.clips.recording")}></progress>
        <${ActionButton} id="stop-recording" />
      </div>
    </div>`
    }
    ${
      clip &&
      it &&
      html`<label class="line clip-place">
      <span>
        ${t("detection.clips.place", { frame: it.number + 1, frames: clip.frames })}
      </span>
      <input
        type="range"
        data-testid="clip-place"
        aria-label=${t("detection.clips.place.slider")}
        min="0"
        max=${clip.frames - 1}
        step="1"
        value=${it.number}
        onInput=${(/** @type {any} */ e) => {
          playing.value = false;
          seek(Number(e.target.value));
        }}
      />
    </label>`
    }
  </div>`;
}
