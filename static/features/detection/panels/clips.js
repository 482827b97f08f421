// Below the picture: hold a frame, record a clip, choose one, step and play.
import { dayAndTime, number, plural } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { ActionButton } from "../../../ui/action_button.js";
import { clips, openClip, playing, recording, removeClip, seek } from "../clips.js";
import { heldFrame } from "../held_frame.js";

export function ClipBar() {
  const it = heldFrame.value,
    clip = it?.clip ?? null;
  return html`<div class="clips" data-testid="clips">
    <div class="line wrap">
      <${ActionButton} id="hold-frame" label=${it ? "Go on" : "Hold"} />
      <${ActionButton} id="next-frame" />
      ${clip && html`
        <${ActionButton} id="previous-frame" />
        <${ActionButton} id="play-clip" label=${playing.value ? "Pause" : "Play"} />
      `}
      <${ActionButton} id="record-clip" />
      ${clips.value.length > 0 && html`<label class="line plan">
        Clip${" "}
        <select
          data-testid="clip"
          value=${clip?.clip ?? ""}
          onChange=${(/** @type {any} */ e) => openClip(e.target.value)}
        >
          <option value="">${clip ? "back to the camera" : "choose…"}</option>
          ${clips.value.map((c) => html`<option key=${c.clip} value=${c.clip}>
            ${dayAndTime(c.taken_at)}, ${number(c.seconds, 1)} s, ${plural(c.frames, "frame")}
          </option>`)}
        </select>
      </label>`}
      ${clip && html`<button type="button" data-testid="remove-clip" onClick=${() => void removeClip(clip)}>
        Remove this clip
      </button>`}
    </div>
    ${recording.value && html`<div class="working" data-testid="recording">
      <div class="line">
        <progress max="1" value=${recording.value.share} aria-label="Recording"></progress>
        <${ActionButton} id="stop-recording" />
      </div>
    </div>`}
    ${clip && it && html`<label class="line clip-place">
      <span>
        Frame ${it.number + 1} of ${clip.frames}
      </span>
      <input
        type="range"
        data-testid="clip-place"
        aria-label="Frame of the clip"
        min="0"
        max=${clip.frames - 1}
        step="1"
        value=${it.number}
        onInput=${(/** @type {any} */ e) => {
          playing.value = false;
          seek(Number(e.target.value));
        }}
      />
    </label>`}
  </div>`;
}
