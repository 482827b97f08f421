// Beside the wall: what the server claims of the site before a match, and what has happened lately.
import { clock } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { toCheck } from "../../verify/claims.js";
import { events, readiness } from "../readiness.js";

/** @typedef {import("../../verify/types").Claim} Claim */

const MARK = { ok: "✓", note: "△", bad: "▲", unknown: "?", running: "" };
const VERDICT = /** @type {const} */ ({
  ready: ["good", "shell.readiness.ready"],
  "not-tested": ["unknown", "shell.readiness.not-tested"],
  problems: ["poor", "shell.readiness.not-ready"],
});
/** What the link beside a claim is called, by where it leads; else "Show". */
const CURES = /** @type {const} */ ({
  images: "shell.readiness.calibrate",
  publishing: "shell.readiness.set-up",
});

export const Readiness = () => html`
  ${readiness.value && html`<${Claims} gate=${readiness.value.gate} items=${readiness.value.items} />`}
  ${
    events.value.length > 0 &&
    html`<section aria-label=${t("shell.events.title")} data-testid="events">
    <h2>${t("shell.events.recent")}</h2>
    <ul class="events">
      ${events.value.map(
        ({ at, text, by }) => html`<li key=${at + text}>
        <time datetime=${at}>${clock(at)}</time>
        <span>${text}${by ? ` ${t("shell.events.by", { name: by })}` : ""}</span>
      </li>`,
      )}
    </ul>
  </section>`
  }
`;

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
    label = t(state === "bad" ? "shell.readiness.fix" : labelOf(claim));
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
