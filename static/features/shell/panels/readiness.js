// Beside the wall: what the server claims of the site before a match, and what has happened lately.
import { useEffect } from "preact/hooks";
import { signal } from "@preact/signals";
import { call } from "../../../core/api.js";
import { clock } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { toCheck } from "../../verify/claims.js";

/** @typedef {import("../../verify/types").Claim} Claim */

const LOOK_MS = 2000, // a knock is told by the second look after it
  EVENTS_MS = 5000,
  SHOWN = 6;
const events = signal(/** @type {{ at: string, kind: string, text: string, by: string | null }[]} */ ([]));
const readiness = signal(
  /** @type {{ gate: import("../../verify/types").Gate, items: Claim[] } | null} */ (null),
);
const MARK = { ok: "✓", note: "○", bad: "▲", unknown: "?", running: "" };
const VERDICT = /** @type {const} */ ({
  ready: ["good", "shell.readiness.ready"],
  "not-tested": ["unknown", "shell.readiness.not-tested"],
  problems: ["poor", "shell.readiness.not-ready"],
});
/** What the link beside a claim is called, by where it leads; else "Show". */
const CURES = /** @type {const} */ ({ images: "shell.readiness.calibrate", publishing: "shell.readiness.set-up" });

/** Call it now and again while the panel is there. @param {() => Promise<void>} look @param {number} everyMs */
function useLook(look, everyMs) {
  useEffect(() => {
    const ask = () => {
      if (!document.hidden) look().catch(() => {}); // a silent server is told elsewhere
    };
    ask();
    const timer = setInterval(ask, everyMs);
    return () => clearInterval(timer);
  }, []);
}

export function Readiness() {
  useLook(async () => {
    events.value = (await call("GET", `/events?limit=${SHOWN}`)).items;
  }, EVENTS_MS);
  useLook(async () => {
    readiness.value = await call("GET", "/readiness");
  }, LOOK_MS);
  return html`
    ${readiness.value && html`<${Claims} gate=${readiness.value.gate} items=${readiness.value.items} />`}
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

/** @param {{ gate: import("../../verify/types").Gate, items: Claim[] }} props */
function Claims({ gate, items }) {
  const [level, word] = VERDICT[gate];
  return html`<section aria-label=${t("shell.readiness.title")} data-testid="readiness" data-gate=${gate}>
    <h2>
      ${t("shell.readiness.title")}${" "}
      <b class=${`level ${level}`}>${t(word)}</b>
    </h2>
    <ul class="readiness">
      ${items.map((claim) => html`<${Line} key=${claim.code} claim=${claim} />`)}
    </ul>
  </section>`;
}

/** @param {{ claim: Claim }} props */
function Line({ claim }) {
  const { id, state, title, value, text, fix, href } = toCheck(claim),
    label = t(state === "bad" && claim.cure !== "images" ? "shell.readiness.fix" : labelOf(claim));
  return html`<li data-testid=${`claim-${id}`} data-state=${state}>
    <span class="mark" aria-hidden="true">${MARK[state]}</span>
    <div>
      <b>${title}</b>
      <small>${[text, value].filter(Boolean).join(" ")}</small>
    </div>
    ${href && html`<a href=${href} title=${fix} aria-label=${`${label}: ${title}`}>${label}</a>`}
  </li>`;
}

/** @param {Claim} claim */
const labelOf = ({ cure, state }) =>
  cure === "rig" && state === "not-tested"
    ? "shell.readiness.check"
    : (CURES[/** @type {keyof typeof CURES} */ (cure)] ?? "shell.readiness.show");
