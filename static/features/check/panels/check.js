// The check of a calibration: the verdict, a row a line, and the picture with the lines as expected and as found.
import { address } from "../../../core/api.js";
import { FAIR_MM, lineTitle, mm, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { Title } from "../../../ui/title.js";
import { Working } from "../../../ui/working.js";
import { checked, checking, closeCheck, notChecked } from "../check.js";

const LEVEL = {
  good: t("common.level.good"),
  fair: t("common.level.fair"),
  poor: t("common.level.poor"),
};
const MARK = 320; // of the picture's longer side, a mark's radius

export const CheckWorking = () => html`<${Working}
  now=${checking.value}
  what=${t("check.checking")}
  stop="stop-check"
  why=${notChecked.value}
  name="check"
/>`;

/** The picture that was checked, under the live one. */
export function CheckedPicture() {
  const it = checked.value;
  if (!it) return null;
  const [width, height] = it.image_size,
    r = Math.max(width, height) / MARK;
  return html`<figure class="checked" data-testid="checked-picture">
    <div class="over">
      <img
        src=${address(`/snapshots/${it.snapshot}/image.jpg`)}
        width=${width}
        height=${height}
        alt=${t("check.picture")}
      />
      <svg
        viewBox=${`-0.5 -0.5 ${width} ${height}`}
        role="img"
        aria-label=${t("check.picture.lines")}
      >
        ${it.points.map(
          (p, i) => html`<g key=${i} class=${Math.abs(p.off_mm) > FAIR_MM ? "far" : "near"}>
          <circle class="expected" cx=${p.expected[0]} cy=${p.expected[1]} r=${r * 0.6} />
          <path d=${`M${p.expected.join()}L${p.found.join()}`} stroke-width=${r * 0.6} />
          <circle cx=${p.found[0]} cy=${p.found[1]} r=${r} />
        </g>`,
        )}
      </svg>
    </div>
    <figcaption class="reason">
      ${t("check.picture.caption", { version: it.version ?? "", limit: FAIR_MM })}
    </figcaption>
  </figure>`;
}

/** At the right: verdict and lines. */
export function CheckReport() {
  const it = checked.value;
  if (!it)
    return html`<section>
      <${Title} of="check">${t("check.title")}<//>
      <p class="reason">
        ${t("check.what-it-does")}
      </p>
    </section>`;
  const { level, sentence, fix } = it.verdict;
  return html`<section aria-label=${t("check.title")} data-testid="check-report">
    <${Title} of="check">${t("check.title")}<//>
    <div
      class="verdict"
      data-testid="check-verdict"
      data-level=${level ?? "unknown"}
      data-reason=${it.verdict.reason}
      role="status"
    >
      <div class="big">${level ? LEVEL[level] : t("check.not-told")}</div>
      <p>
        ${sentence} ${fix}
      </p>
    </div>
    <table class="lines-checked">
      <thead>
        <tr>
          <th scope="col">${t("check.table.line")}</th>
          <th scope="col">${t("check.table.found")}</th>
          <th scope="col">mm</th>
          <th scope="col">${t("check.table.worst")}</th>
        </tr>
      </thead>
      <tbody>
        ${it.lines.map(
          (l) => html`<tr key=${l.feature} data-testid=${`line-${l.feature}`}>
          <th scope="row">${lineTitle(l.feature)}</th>
          <td>${number(100 * l.found_share, 0)} %</td>
          <td>${l.rms_mm === null ? "–" : mm(l.rms_mm)}</td>
          <td>${l.worst_mm === null ? "–" : mm(l.worst_mm)}</td>
        </tr>`,
        )}
      </tbody>
    </table>
    <p class="reason">
      ${t("check.table.explained", { version: it.version ?? "" })}
    </p>
    <button type="button" data-testid="close-check" onClick=${closeCheck}>
      ${t("common.close")}
    </button>
  </section>`;
}
