// Right of a rig and of its desk of matched points: what the check says, of all cameras and of each two.
import { mm, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf } from "../../../core/route.js";
import { t } from "../../../core/words.js";
import { rich } from "../../../ui/rich.js";
import { isComplete, kept, keyOf, twos } from "../kept_matches.js";
import { checked, isChanged, members } from "../match_desk.js";
import { found, plane, rig } from "../rig.js";
import { TrackReport } from "./tracks.js";

/** @typedef {import("../types").Pair} Pair */

const LEVEL = {
  good: t("common.level.good"),
  fair: t("common.level.fair"),
  poor: t("common.level.poor"),
};
const BY = {
  pictures: t("rig.by.pictures"),
  matches: t("rig.by.matches"),
  clicks: t("rig.by.clicks"),
};

export function RigReport() {
  const it = found.value,
    before = rig.value?.checked,
    titles = Object.fromEntries((rig.value?.cameras ?? []).map((c) => [c.camera, c.title])),
    pairs =
      it?.pairs.map((p) => ({ ...p, p })) ??
      twos(Object.keys(titles)).map(([a, b]) => ({ a, b, p: null }));
  return html`
    <${TrackReport} />
    ${
      it || before
        ? html`<${Verdict} verdict=${(it ?? before)?.verdict} missing=${it?.missing ?? []} titles=${titles} />`
        : html`<${Advice} />`
    }
    ${pairs.map(
      ({ a, b, p }) => html`<section
      key=${`${a} ${b}`}
      aria-label=${t("rig.pair", { first: titles[a], second: titles[b] })}
      data-testid=${`pair-${a}-${b}`}
    >
      <h2>${titles[a] ?? a} – ${titles[b] ?? b}</h2>
      ${p && html`<${OnePair} p=${p} />`}
      <${Door} a=${a} b=${b} />
    </section>`,
    )}
  `;
}

/** To the desk of two cameras. @param {{ a: string, b: string }} props */
function Door({ a, b }) {
  const name = rig.value?.name ?? "",
    count = kept(keyOf(name, a, b)).matches.filter(isComplete).length;
  return html`<p class="door">
    <a
      class="as-button"
      href=${addressOf("match", { rig: name, left: a, right: b })}
      data-testid=${`door-${a}-${b}`}
    >
      ${t("rig.match.open")}
    </a>
    ${count > 0 && html`<small>${t("rig.match.count", { count })}</small>`}
  </p>`;
}

const Advice = () => html`<section>
  <h2>${t("rig.advice.title")}</h2>
  <ul class="plain">
    ${
      /** @type {const} */ (["empty", "check", "knocked"]).map(
        (it) => html`<li key=${it}>
      ${rich(`rig.advice.${it}`)}
    </li>`,
      )
    }
  </ul>
</section>`;

/**
 * @param {{ verdict: import("../types").RigCheck["verdict"], missing: import("../types").RigCheck["missing"],
 *   titles: Record<string, string> }} props
 */
const Verdict = ({ verdict, missing, titles }) => html`<section aria-label=${t("common.verdict")}>
  <h2>${t("rig.verdict.title")}</h2>
  <div class="verdict" data-testid="rig-verdict" data-level=${verdict.level}>
    ${verdict.level && html`<b class=${`level ${verdict.level}`}>${LEVEL[verdict.level]}.</b>`} ${verdict.sentence}
    ${verdict.fix && html`<p class="fix">${verdict.fix}</p>`}
  </div>
  ${missing.map(
    (m) => html`<p key=${m.camera} class="warning-line">
    <b>${titles[m.camera] ?? m.camera}: ${m.text}</b>${" "}
    ${m.fix}
  </p>`,
  )}
</section>`;

/** At the desk: the same of its two, and what good matches are. */
export function MatchReport() {
  const p = checked.value,
    unknown = p?.matches?.failed.find(({ part }) => part === "fundamental"),
    { a, b } = members.value ?? {};
  if (!a || !b) return null;
  return html`
    ${
      p &&
      html`<section aria-label=${t("common.verdict")} data-testid="match-report" data-stale=${isChanged.value}>
      <h2>${a.title} – ${b.title}</h2>
      ${isChanged.value && html`<p class="warning-line" role="status">${t("rig.match.changed")}</p>`}
      <${OnePair} p=${p} />
      ${
        unknown &&
        html`<p class="reason" data-testid="no-outliers">
        <b>${t("rig.match.no-outliers")} ${unknown.what}</b>${" "}
        ${unknown.fix}
      </p>`
      }
    </section>`
    }
    <section>
      <h2>${t("rig.match.advice.title")}</h2>
      <ul class="plain">
        ${
          /** @type {const} */ (["spread", "tops", "still", "check"]).map(
            (it) => html`<li key=${it}>
          ${rich(`rig.match.advice.${it}`)}
        </li>`,
          )
        }
      </ul>
    </section>
  `;
}

/** @param {number} v */
const shortly = (v) => v.toExponential(5).padStart(13);

/** @param {{ p: Pair }} props */
function OnePair({ p }) {
  const at = p.agreement?.[plane.value],
    { verdict, failed, fundamental } = p;
  if (failed)
    return html`<p class="reason">
      <b>${failed.what}</b> ${failed.fix}
    </p>`;
  return html`<div class="one-pair">
    ${
      verdict &&
      html`
      <p>
        ${verdict.level && html`<b class=${`level ${verdict.level}`}>${LEVEL[verdict.level]}.</b>`} ${verdict.sentence}
      </p>
      <p class="fix">${verdict.fix}</p>
    `
    }
    ${
      at &&
      html`<dl class="details">
      <div>
        <dt>${t("rig.pair.mean")}</dt>
        <dd data-testid="pair-mean">${mm(at.mean_mm)} mm</dd>
      </div>
      <div>
        <dt>${t("rig.pair.most-below")}</dt>
        <dd>${mm(at.p95_mm)} mm</dd>
      </div>
      <div>
        <dt>${t("rig.pair.worst")}</dt>
        <dd data-testid="pair-max">
          ${t("rig.pair.worst-at", { worst: mm(at.max_mm), x: number(at.where[0], 0), y: number(at.where[1], 0) })}
        </dd>
      </div>
    </dl>`
    }
    ${
      p.from &&
      html`<p class="reason">
      ${t("rig.pair.measures", {
        by: BY[p.from],
        believed: p.agreement?.believed ?? "",
        count: p.agreement?.n ?? "",
        area: number(p.agreement?.overlap_m2, 1),
      })}
    </p>`
    }
    ${
      fundamental &&
      html`<details class="more">
      <summary>${t("common.fundamental-matrix")}</summary>
      <pre>${fundamental.matrix.map((row) => row.map(shortly).join(" ")).join("\n")}</pre>
      <p class="reason">${t("rig.pair.foretold", { distance: number(fundamental.baseline_mm, 0) })}</p>
    </details>`
    }
  </div>`;
}
