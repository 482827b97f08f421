// A version at a glance: its picture, and what it changed against the version before it.
import { useEffect, useRef } from "preact/hooks";
import { address } from "../../../core/api.js";
import { FAIR_MM, GOOD_MM, mm } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { rich } from "../../../ui/rich.js";
import { arrowPath } from "../../../canvas/arrows.js";
import { arrowsOf, changes, loadChange, pairOf } from "../changes.js";

/** @typedef {import("../types").VersionRecord} Kept */

const WIDTH = 96,
  HEIGHT = 72,
  SHARP = 2; // px of the picture to one of the page

/** @param {number} far */
const levelOf = (far) => (far <= GOOD_MM ? "good" : far <= FAIR_MM ? "fair" : "poor");

/** before: of the same camera; null: there is none. @param {{ it: Kept, before: Kept | null }} props */
export function VersionChange({ it, before }) {
  const place = useRef(/** @type {HTMLElement | null} */ (null));
  useEffect(() => {
    if (!before) return undefined;
    const watch = new IntersectionObserver((entries) => {
      if (!entries.some((entry) => entry.isIntersecting)) return;
      watch.disconnect();
      void loadChange(before.id, it.id);
    });
    watch.observe(/** @type {Element} */ (place.current));
    return () => watch.disconnect();
  }, [before?.id, it.id]);
  const found = before ? changes.value.get(pairOf(before.id, it.id)) : undefined;
  return html`<div class="changed" ref=${place} data-testid="version-change">
    ${
      it.snapshot &&
      html`<span class="thumb">
        <img
          src=${address(`/snapshots/${it.snapshot}/image.jpg?width=${SHARP * WIDTH}`)}
          width=${WIDTH}
          height=${HEIGHT}
          loading="lazy"
          decoding="async"
          alt=${t("versions.change.picture", { version: it.version })}
          onError=${(/** @type {any} */ e) => {
            e.target.hidden = true;
          }}
        />
      </span>`
    }
    ${before && html`<span class="thumb map">${found?.is?.grid && html`<${ChangeMap} grid=${found.is.grid} />`}</span>`}
    <small data-testid="version-change-words">
      ${
        !before
          ? t("versions.change.first")
          : !found
            ? t("common.asking")
            : found.is?.grid
              ? rich("versions.change.largest", {
                  version: before.version ?? "",
                  distance: html`<b class=${`level ${levelOf(found.is.max_mm ?? 0)}`}>${mm(found.is.max_mm)} mm</b>`,
                })
              : t("versions.change.none", { version: before.version ?? "", why: found.why })
      }
    </small>
  </div>`;
}

/** @param {{ grid: NonNullable<import("../types").VersionDifference["grid"]> }} props */
const ChangeMap = ({ grid }) => html`<svg viewBox=${`0 0 ${WIDTH} ${HEIGHT}`} aria-hidden="true">
  ${arrowsOf(grid, WIDTH, HEIGHT).map(
    (arrow, i) => html`<path
      key=${i}
      data-level=${levelOf(arrow.mm)}
      d=${arrowPath(arrow, 1, 4 * WIDTH)}
    />`,
  )}
</svg>`;
