// Beside the wall: whether a match could begin, point by point, and what has happened lately.
import { useEffect } from "preact/hooks";
import { signal } from "@preact/signals";
import { call } from "../../../core/api.js";
import { clock, mm, plural } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf } from "../../../core/route.js";
import { cameras } from "../../../core/state.js";
import { statuses } from "../../live/camera_status.js";
import { publishing } from "../../network/network.js";
import { rigs } from "../../rig/rig.js";
import { isBroken } from "../problems.js";

const EVENTS_MS = 5000,
  SHOWN = 6;
/** @typedef {{ state: "ok" | "note" | "bad", title: string, text: string, href: string, label: string }} Point */
const events = signal(/** @type {{ at: string, kind: string, text: string, by: string | null }[]} */ ([]));
const MARK = { ok: "✓", note: "○", bad: "▲" };

/** @param {number} count @param {number} all @param {string} what */
const of = (count, all, what) => `${count} of ${plural(all, "camera")} ${what}`;
const names = (/** @type {import("../../../core/types").Camera[]} */ some) => some.map((c) => c.name).join(", ");

/** @returns {Point[]} */
function points() {
  const all = cameras.value,
    live = all.filter((c) => statuses.value[c.id]?.state === "live"),
    down = all.filter((c) => isBroken(c.id)),
    waking = all.filter((c) => !live.includes(c) && !down.includes(c)),
    calibrated = all.filter((c) => c.active_calibration),
    bare = all.filter((c) => !c.active_calibration),
    outdated = all.filter((c) => c.active?.field_changes.length),
    moved = all.filter((c) => statuses.value[c.id]?.drift?.alarm),
    out = publishing.value,
    rig = rigs.value[0];
  return [
    {
      state: down.length ? "bad" : waking.length ? "note" : "ok",
      title: of(live.length, all.length, "live"),
      text: down.length ? names(down) : waking.length ? `Starting: ${names(waking)}` : "",
      href: down.length ? addressOf("live", { camera: down[0].id }) : "",
      label: "Show",
    },
    {
      state: bare.length ? "bad" : "ok",
      title: of(calibrated.length, all.length, "calibrated"),
      text: bare.length ? `Without an active version: ${names(bare)}` : "",
      href: bare.length ? addressOf("camera-images", { camera: bare[0].id }) : "",
      label: "Calibrate",
    },
    {
      state: moved.length ? "bad" : "ok",
      title: moved.length ? `${plural(moved.length, "camera")} moved` : "No camera has moved",
      text: moved.length ? names(moved) : "",
      href: moved.length ? addressOf("drift", { camera: moved[0].id }) : "",
      label: "Fix",
    },
    ...(outdated.length ? [ofOutdated(outdated)] : []),
    ...(rig ? [ofRig(rig)] : []),
    {
      state: out?.problem ? "bad" : out?.state === "on-air" ? "ok" : "note",
      title: out?.state === "on-air" ? "Publishing" : "Not publishing",
      text: "SSL-Vision geometry",
      href: addressOf("publishing"),
      label: out?.state === "on-air" ? "Show" : "Set up",
    },
  ];
}

/** Calibrated before their field was changed. @param {import("../../../core/types").Camera[]} some @returns {Point} */
const ofOutdated = (some) => ({
  state: "bad",
  title: "Field changed since",
  text: `Calibrated before: ${names(some)}`,
  href: addressOf("versions", { camera: some[0].id }),
  label: "Fix",
});

/** @param {import("../../rig/types").Rig} rig @returns {Point} */
function ofRig({ name, title, checked }) {
  const level = checked?.verdict.level;
  return {
    state: !checked ? "note" : level === "poor" ? "bad" : level === "good" ? "ok" : "note",
    title: !checked ? "Agreement not checked" : level === "poor" ? "Cameras do not agree" : "Cameras agree",
    text: `${title || name}${checked?.p95_mm ? `: ${mm(checked.p95_mm)} mm` : ""}`,
    href: addressOf("rig", { rig: name }),
    label: checked ? "Show" : "Check",
  };
}

export function Readiness() {
  useEffect(() => {
    const look = () =>
      void call("GET", `/events?limit=${SHOWN}`).then(
        ({ items }) => {
          events.value = items;
        },
        () => {}, // a silent server is told elsewhere
      );
    look();
    const timer = setInterval(look, EVENTS_MS);
    return () => clearInterval(timer);
  }, []);
  const all = points(),
    isReady = all.every((p) => p.state !== "bad");
  return html`
    <section aria-label="Match readiness" data-testid="readiness" data-ready=${String(isReady)}>
      <h2>Match readiness <b class=${`level ${isReady ? "good" : "poor"}`}>${isReady ? "Ready" : "Not ready"}</b></h2>
      <ul class="readiness">
        ${all.map(({ state, title, text, href, label }) => html`<li key=${title} data-state=${state}>
          <span class="mark" aria-hidden="true">${MARK[state]}</span>
          <div>
            <b>${title}</b>
            <small>${text}</small>
          </div>
          ${href && html`<a href=${href} aria-label=${`${label}: ${title}`}>${label}</a>`}
        </li>`)}
      </ul>
    </section>
    ${events.value.length > 0 && html`<section aria-label="Recent events" data-testid="events">
      <h2>Recent</h2>
      <ul class="events">
        ${events.value.map(({ at, text, by }) => html`<li key=${at + text}>
          <time datetime=${at}>${clock(at)}</time>
          <span>${text}${by ? ` By ${by}.` : ""}</span>
        </li>`)}
      </ul>
    </section>`}
  `;
}
