// Imports calibrations from files, ours or of other programs; the operator adds what a file does not hold.
import { signal } from "@preact/signals";
import { request } from "../../core/api.js";
import { busy, cameras, notify } from "../../core/state.js";
import { t } from "../../core/words.js";

/** What is said beside a file; empty says nothing. */
export const importOptions = signal({ camera: "", field: "", region: "", image_size: "" });
/**
 * What became of the last file.
 * @type {import("@preact/signals").Signal<{ name: string, kept: Kept | null, why: import("../../core/types").Refusal |
 * null } | null>}
 */
export const imported = signal(
  /** @type {{ name: string, kept: Kept | null, why: import("../../core/types").Refusal | null } | null} */ (
    null
  ),
);

/** @typedef {{ id: string, version: number | null, camera: string | null, note: string, isLens: boolean }} Kept */

const ABOUT = "import";
const SUFFIXES = ["json", "yml", "yaml", "csv", "cameramodel", "pb"];
export const ACCEPTED = SUFFIXES.map((suffix) => `.${suffix}`).join(",");

/**
 * Whether a file that was dropped is for here and not for the pictures.
 * @param {{ name?: string, type: string }} file
 */
export const isCalibrationFile = (file) =>
  !file.type.startsWith("image/") &&
  SUFFIXES.includes((file.name ?? "").toLowerCase().split(".").at(-1) ?? "");

/** Keep what a file holds, as a new version or a lens. @param {Blob & { name?: string }} file */
export async function importFile(file) {
  if (busy.value) return;
  const name = file.name || t("versions.import.the-file"),
    body = new FormData();
  body.append("file", file, name);
  for (const [what, text] of Object.entries(importOptions.value)) if (text) body.append(what, text);
  busy.value = t("versions.import.reading", { file: name });
  imported.value = null;
  try {
    const answer = await request("POST", "/calibrations/import", { body });
    const record = await answer.json(),
      isLens = (answer.headers.get("Location") ?? "").includes("/lenses/");
    imported.value = { name, kept: { ...record, isLens }, why: null };
    notify({
      level: "info",
      text: importMessage({ ...record, isLens }),
      fix: record.note,
      about: ABOUT,
    });
  } catch (error) {
    const { message, fix = t("versions.import.failed.fix") } =
      /** @type {Error & { fix?: string }} */ (error);
    imported.value = { name, kept: null, why: { detail: `${name}: ${message}`, fix } };
    // the file may have been dropped far from the button
    notify({ level: "warn", text: `${name}: ${message}`, fix, about: ABOUT });
  } finally {
    busy.value = "";
  }
}

/** What was kept, in a sentence. @param {Kept} kept */
export function importMessage({ version, camera, isLens }) {
  const whose = camera ? (cameras.value.find((c) => c.id === camera)?.name ?? camera) : "",
    number = String(version);
  if (isLens) return t("versions.import.lens-imported");
  return camera
    ? t("versions.import.imported-for", { version: number, camera: whose })
    : t("versions.import.imported", { version: number });
}
