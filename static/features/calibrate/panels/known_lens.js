// A known lens, and how strongly the fit is held to it.
import { change, doc } from "../../../core/document.js";
import { dayAndTime, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { cameras, modelName, snapshot } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { calibrations, isSuited, lenses } from "../../boards/lenses.js";

/** @typedef {import("./options.js").Props} Props */

/** @param {Props} props */
export function KnownLens({ option: { name }, value, about }) {
  const boards = lenses.value.filter((l) => isSuited(l, modelName.value)),
    made = calibrations.value.filter((c) => isSuited(c, modelName.value));
  const others = lenses.value.length + calibrations.value.length - boards.length - made.length,
    sigma = `${name}_sigma`;
  const isKnown = value === null || [...boards, ...made].some((l) => l.id === value);
  const hasSigma =
    boards.some((l) => l.id === value && l.rms_px !== null) ||
    made.some((c) => c.id === value && c.report.covariance?.names.includes("log_focal"));
  /** Another lens is held fast until the operator says otherwise. @param {string | null} id */
  const hold = (id) => {
    const { [name]: _lens, [sigma]: _sigma, ...rest } = doc.value.options;
    change({ ...doc.value, options: id ? { ...rest, [name]: id, [sigma]: "0" } : rest });
  };
  return html`
    <select ...${about} value=${value ?? ""} onChange=${(/** @type {any} */ e) => hold(e.target.value || null)}>
      <option value="">${t("calibrate.known-lens.none")}</option>
      ${!isKnown && html`<option value=${value}>${t("calibrate.known-lens.unknown")}</option>`}
      ${
        boards.length > 0 &&
        html`<optgroup label=${t("calibrate.known-lens.group.boards")}>
        ${boards.map(
          (l) => html`<option key=${l.id} value=${l.id}>
          ${boardTitle(l)}
        </option>`,
        )}
      </optgroup>`
      }
      ${
        made.length > 0 &&
        html`<optgroup label=${t("calibrate.known-lens.group.calibrations")}>
        ${made.map(
          (c) => html`<option key=${c.id} value=${c.id}>
          ${madeTitle(c)}
        </option>`,
        )}
      </optgroup>`
      }
    </select>
    ${
      value !== null &&
      html`<select
      data-testid=${`option-${sigma}`}
      aria-label=${t("calibrate.known-lens.hold")}
      value=${doc.value.options[sigma] ?? "0"}
      onChange=${(/** @type {any} */ e) =>
        change({ ...doc.value, options: { ...doc.value.options, [sigma]: e.target.value } })}
    >
      <option value="0">${t("calibrate.known-lens.hold.fast")}</option>
      <option value="own" disabled=${!hasSigma}>
        ${hasSigma ? t("calibrate.known-lens.hold.as-known") : t("calibrate.known-lens.hold.not-known")}
      </option>
    </select>`
    }
    ${
      others > 0 &&
      html`<small>
      ${t("calibrate.known-lens.not-listed", {
        count: others,
        width: snapshot.value?.width ?? "",
        height: snapshot.value?.height ?? "",
      })}
    </small>`
    }
  `;
}

/** @param {import("../../../core/types").Lens} l */
const boardTitle = (l) =>
  [
    l.note.replace(/\.$/, "") ||
      (l.board ? `${l.board.columns} × ${l.board.rows} ${l.board.kind}` : t("common.corners")),
    ...(l.views ? [t("common.views", { count: l.views }), `${number(l.rms_px, 2)} px`] : []),
    dayAndTime(l.created_at),
  ].join(", ");

/** @param {import("../../../core/types").Calibration} c */
const madeTitle = (c) => {
  const camera = cameras.value.find((it) => it.id === c.camera)?.name ?? null,
    { version } = c,
    made = dayAndTime(c.created_at);
  return camera === null
    ? t("calibrate.known-lens.version-from-file", { version, made })
    : t("calibrate.known-lens.version", { version, camera, made });
};
