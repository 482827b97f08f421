// The start page: cameras, a place to drop a picture, and the pictures that were worked on.
import { run } from "../../../core/actions.js";
import { address } from "../../../core/api.js";
import { dayAndTime } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf } from "../../../core/route.js";
import { busy, cameras, opening, snapshots } from "../../../core/state.js";
import { ActionButton } from "../../../ui/action_button.js";
import { LensForNextPicture, ToBoard } from "../../board/panels/board.js";
import { TourButton } from "../../help/panels/tour.js";
import { Cameras } from "../../live/panels/cameras.js";
import { Network } from "../../network/panels/network.js";
import { Rigs } from "../../rig/panels/rig.js";
import { Import } from "../../versions/panels/imports.js";

export function Start() {
  if (opening.value)
    return html`<div class="start" aria-busy="true">
      <p class="dim">Opening…</p>
    </div>`;
  return html`<div class="start">
    <h1>Calibrate a camera</h1>
    <p class="dim">
      Choose a camera. Its field lines are detected automatically; check them, verify the result, and activate
      it.
    </p>
    <div class="line">
      <${TourButton} />
    </div>
    <${LensForNextPicture} />
    <${Cameras} />
    <section aria-label="Open a picture">
      <h2>${cameras.value.length ? "Or use a picture you have" : "Use a picture you have"}</h2>
      <button
        type="button"
        class="drop"
        data-testid="drop"
        disabled=${busy.value !== ""}
        onClick=${() => run("open")}
      >
        <b>${busy.value || "Open a picture…"}</b>
        <small>or drop it here, or paste it. PNG, JPEG, BMP or WebP.</small>
      </button>
    </section>
    <${Import} />
    <${ToBoard} />
    <section aria-label="Two cameras">
      <h2>Do two cameras agree?</h2>
      <${ActionButton} id="pair" />
    </section>
    <${Rigs} />
    <section aria-label="Pages">
      <h2>What there is already</h2>
      <div class="line">
        <${ActionButton} id="versions" label="Saved versions" />
        <${ActionButton} id="jobs" label="Long work" />
        <${ActionButton} id="settings" label="Settings" />
      </div>
    </section>
    <${Network} />
    ${snapshots.value.length > 0 && html`<section aria-label="Earlier pictures">
      <h2>Go on with an earlier picture</h2>
      <ul class="recent">
        ${snapshots.value.map((s) => html`<li key=${s.id}>
          <a href=${addressOf("calibrate", { picture: s.id, step: "points" })} data-testid=${`recent-${s.id}`}>
            <span class="sr">Go on with the picture of </span>
            <img loading="lazy" alt="" src=${address(`/snapshots/${s.id}/image.jpg`)} />
            <small>
              ${dayAndTime(s.taken_at)}
              <br />
              ${s.width} × ${s.height} px
            </small>
          </a>
        </li>`)}
      </ul>
    </section>`}
  </div>`;
}
