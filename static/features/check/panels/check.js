// The check of a calibration: the verdict, a row a line, and the picture with the lines as expected and as found.
import { address } from "../../../core/api.js";
import { mm, number, words } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { Title } from "../../../ui/title.js";
import { Working } from "../../../ui/working.js";
import { checked, checking, closeCheck, notChecked } from "../check.js";

const LEVEL = { good: "Good", fair: "Fair", poor: "Poor" };
const FAR_MM = 15; // as verdicts have it
const MARK = 320; // of the picture's longer side, a mark's radius

export const CheckWorking = () => html`<${Working}
  now=${checking.value}
  what="Checking the calibration"
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
        alt="The picture that was checked"
      />
      <svg
        viewBox=${`-0.5 -0.5 ${width} ${height}`}
        role="img"
        aria-label="Where the calibration has the lines, and where they are"
      >
        ${it.points.map((p, i) => html`<g key=${i} class=${Math.abs(p.off_mm) > FAR_MM ? "far" : "near"}>
          <circle class="expected" cx=${p.expected[0]} cy=${p.expected[1]} r=${r * 0.6} />
          <path d=${`M${p.expected.join()}L${p.found.join()}`} stroke-width=${r * 0.6} />
          <circle cx=${p.found[0]} cy=${p.found[1]} r=${r} />
        </g>`)}
      </svg>
    </div>
    <figcaption class="reason">
      White: where version ${it.version} has the lines. Coloured: where they are; more than ${FAR_MM} mm off in
      red.
    </figcaption>
  </figure>`;
}

/** At the right: verdict and lines. */
export function CheckReport() {
  const it = checked.value;
  if (!it)
    return html`<section>
      <${Title} of="check">Check<//>
      <p class="reason">
        Holds the active version against an image of now: which field lines are where it has them, and how far the
        others are.
      </p>
    </section>`;
  const { level, sentence, fix } = it.verdict;
  return html`<section aria-label="Check" data-testid="check-report">
    <${Title} of="check">Check<//>
    <div
      class="verdict"
      data-testid="check-verdict"
      data-level=${level ?? "unknown"}
      data-reason=${it.verdict.reason}
      role="status"
    >
      <div class="big">${level ? LEVEL[level] : "Not told"}</div>
      <p>
        ${sentence} ${fix}
      </p>
    </div>
    <table class="lines-checked">
      <thead>
        <tr>
          <th scope="col">Line</th>
          <th scope="col">found</th>
          <th scope="col">mm</th>
          <th scope="col">worst</th>
        </tr>
      </thead>
      <tbody>
        ${it.lines.map((l) => html`<tr key=${l.feature} data-testid=${`line-${l.feature}`}>
          <th scope="row">${words(l.feature)}</th>
          <td>${number(100 * l.found_share, 0)} %</td>
          <td>${l.rms_mm === null ? "–" : mm(l.rms_mm)}</td>
          <td>${l.worst_mm === null ? "–" : mm(l.worst_mm)}</td>
        </tr>`)}
      </tbody>
    </table>
    <p class="reason">
      mm: how far the line lies from where version ${it.version} has it, across it on the carpet.
    </p>
    <button type="button" data-testid="close-check" onClick=${closeCheck}>
      Close
    </button>
  </section>`;
}
