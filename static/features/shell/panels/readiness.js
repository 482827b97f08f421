// Beside the wall: whether a match could begin, point by point, and what has happened lately.
import { useEffect } from "preact/hooks";
import { signal } from "@preact/signals";
import { call } from "../../../core/api.js";
import { clock, mm } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf } from "../../../core/route.js";
import { cameras } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { statuses } from "../../live/camera_status.js";
import { publishing } from "../../network/network.js";
import { rigs } from "../../rig/rig.js";
import { isBroken } from "../problems.js";

const EVENTS_MS = 5000,
  SHOWN = 6;
/** @typedef {{ state: "ok" | "note" | "bad", title: string, text: string, href: string, label: string }} Point */
const events = signal(/** @type {{ at: string, kind: string, text: string, by: string | null }[]} */ ([]));
const MARK = { ok: "✓", note: "○", bad: "▲" };

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
      title: t("shell.readiness.live", { live: live.length, count: all.length }),
      text: down.length ? names(down) : waking.length ? t("shell.readiness.starting", { cameras: names(waking) }) : "",
      href: down.length ? addressOf("live", { camera: down[0].id }) : "",
      label: t("shell.readiness.show"),
    },
    {
      state: bare.length ? "bad" : "ok",
      title: t("shell.readiness.calibrated", { calibrated: calibrated.length, count: all.length }),
      text: bare.length ? t("shell.readiness.not-calibrated", { cameras: names(bare) }) : "",
      href: bare.length ? addressOf("camera-images", { camera: bare[0].id }) : "",
      label: t("shell.readiness.calibrate"),
    },
    {
      state: moved.length ? "bad" : "ok",
      title: moved.length ? t("shell.readiness.moved", { count: moved.length }) : t("shell.readiness.none-moved"),
      text: moved.length ? names(moved) : "",
      href: moved.length ? addressOf("drift", { camera: moved[0].id }) : "",
      label: t("shell.readiness.fix"),
    },
    ...(outdated.length ? [ofOutdated(outdated)] : []),
    ...(rig ? [ofRig(rig)] : []),
    {
      state: out?.problem ? "bad" : out?.state === "on-air" ? "ok" : "note",
      title: out?.state === "on-air" ? t("shell.readiness.publishing") : t("shell.readiness.not-publishing"),
      text: t("shell.readiness.geometry"),
      href: addressOf("publishing"),
      label: out?.state === "on-air" ? t("shell.readiness.show") : t("shell.readiness.set-up"),
    },
  ];
}

/** Calibrated before their field was changed. @param {import("../../../core/types").Camera[]} some @returns {Point} */
const ofOutdated = (some) => ({
  state: "bad",
  title: t("common.field-changed"),
  text: t("shell.readiness.calibrated-before", { cameras: names(some) }),
  href: addressOf("versions", { camera: some[0].id }),
  label: t("shell.readiness.fix"),
});

/** @param {import("../../rig/types").Rig} rig @returns {Point} */
function ofRig({ name, title, checked }) {
  const level = checked?.verdict.level;
  return {
    state: !checked ? "note" : level === "poor" ? "bad" : level === "good" ? "ok" : "note",
    title: !checked
      ? t("shell.readiness.not-checked")
      : level === "poor"
        ? t("shell.readiness.disagree")
        : t("shell.readiness.agree"),
    text: `${title || name}${checked?.p95_mm ? `: ${mm(checked.p95_mm)} mm` : ""}`,
    href: addressOf("rig", { rig: name }),
    label: checked ? t("shell.readiness.show") : t("shell.readiness.check"),
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
    <section aria-label=${t("shell.readiness.title")} data-testid="readiness" data-ready=${String(isReady)}>
      <h2>
        ${t("shell.readiness.title")}${" "}
        <b class=${`level ${isReady ? "good" : "poor"}`}>
          ${isReady ? t("shell.readiness.ready") : t("shell.readiness.not-ready")}
        </b>
      </h2>
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
    ${events.value.length > 0 && html`<section aria-label=${t("shell.events.title")} data-testid="events">
      <h2>${t("shell.events.recent")}</h2>
      <ul class="events">
        ${events.value.map(({ at, text, by }) => html`<li key=${at + text}>
          <time datetime=${at}>${clock(at)}</time>
          <span>${text}${by ? ` ${t("shell.events.by", { name: by })}` : ""}</span>
        </li>`)}
      </ul>
    </section>`}
  `;
}
