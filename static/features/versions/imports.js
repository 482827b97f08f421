// Imports calibrations from files, ours or of other programs; the operator adds what a file does not hold.
import { signal } from "@preact/signals";
import { Problem, request, toRefusal } from "../../core/api.js";
import { go } from "../../core/route.js";
import { busy, cameras, notify } from "../../core/state.js";
import { t } from "../../core/words.js";
import { newestPicture } from "./lens_choices.js";

/** What is said beside a file; empty says nothing. */
export const importOptions = signal({
  camera: "",
  field: "",
  region: "",
  image_size: "",
  turn: "",
});
/**
 * What became of the last file; choices: the answers to what it does not say, each of which reads it again.
 * @typedef {import("../../core/types").LensReading} LensReading
 * @typedef {{ label: string, stated: Record<string, string>, lens?: LensReading, entries?: string[] }} Choice
 * @typedef {{ name: string, kept: Kept | null, why: import("../../core/types").Refusal | null, choices: Choice[],
 * choose: (choice: Choice) => void }} Outcome
 */
export const imported = signal(/** @type {Outcome | null} */ (null));

/** @typedef {{ id: string, version: number | null, camera: string | null, note: string, isLens: boolean }} Kept */

const ABOUT = "import";
const SUFFIXES = [
  "json",
  "yml",
  "yaml",
  "csv",
  "cameramodel",
  "pb",
  "xml",
  "toml",
  "ini",
  "txt",
  "npz",
];
export const ACCEPTED = SUFFIXES.map((suffix) => `.${suffix}`).join(",");

/**
 * Whether a file that was dropped is for here and not for the pictures.
 * @param {{ name?: string, type: string }} file
 */
export const isCalibrationFile = (file) =>
  !file.type.startsWith("image/") &&
  SUFFIXES.includes((file.name ?? "").toLowerCase().split(".").at(-1) ?? "");

/** By the refusal's reason. @param {import("../../core/types").Refusal} why @returns {Promise<Choice[]>} */
async function choicesOf({ reason, entries = [], lenses = [] }) {
  if (reason === "several-cameras") return choicesOfCameras(entries);
  if (reason === "unstated-lens")
    return lenses.map((lens) => ({
      label: t(`versions.import.lens.${lens.model}`),
      stated: { model: lens.model },
      lens,
    }));
  if (reason === "no-field") return [{ label: t("versions.import.read-again"), stated: {} }];
  if (reason !== "no-image-size") return [];
  const { camera } = importOptions.value,
    seen = await newestPicture(camera).catch(() => null);
  return [
    ...(seen ? [choiceOfSize(seen)] : []),
    { label: t("versions.import.read-again"), stated: {} },
  ];
}

/** Each alone, and all where none is for a certain camera. @param {string[]} entries @returns {Choice[]} */
const choicesOfCameras = (entries) => [
  ...entries.map((entry) => ({
    label: /^\d+$/.test(entry) ? t("versions.import.camera-number", { number: entry }) : entry,
    stated: { entry },
  })),
  ...(importOptions.value.camera
    ? []
    : [{ label: t("versions.import.every-camera"), stated: {}, entries }]),
];

/** @param {import("../../core/types").Snapshot} picture @returns {Choice} */
const choiceOfSize = ({ width, height, camera }) => ({
  label: t("versions.import.size-of-image", {
    width,
    height,
    camera: cameras.value.find((c) => c.id === camera)?.name ?? camera ?? "",
  }),
  stated: { image_size: `${width}x${height}` },
});

/**
 * Keep what a file holds, as a new version or a lens.
 * @param {Blob & { name?: string }} file @param {Record<string, string>} [stated] what was chosen for this file alone
 */
export async function importFile(file, stated = {}) {
  if (busy.value) return;
  const name = file.name || t("versions.import.the-file"),
    body = new FormData();
  body.append("file", file, name);
  for (const [what, text] of Object.entries({ ...importOptions.value, ...stated }))
    if (text) body.append(what, text);
  busy.value = t("versions.import.reading", { file: name });
  imported.value = null;
  const outcome = {
    name,
    kept: null,
    why: null,
    choices: [],
    choose: (/** @type {Choice} */ choice) => void importChosen(file, stated, choice),
  };
  try {
    const answer = await request("POST", "/calibrations/import", { body });
    const record = await answer.json(),
      isLens = (answer.headers.get("Location") ?? "").includes("/lenses/");
    imported.value = { ...outcome, kept: { ...record, isLens } };
    notify({
      level: "info",
      text: importMessage({ ...record, isLens }),
      fix: record.note,
      about: ABOUT,
    });
  } catch (error) {
    const { message, fix = t("versions.import.failed.fix") } =
      /** @type {Error & { fix?: string }} */ (error);
    const text = `${name}: ${message}`,
      choices = error instanceof Problem ? await choicesOf(toRefusal(error)) : [];
    imported.value = { ...outcome, why: { detail: text, fix }, choices };
    // the file may have been dropped on another page
    if (choices.length > 0) go("import");
    else notify({ level: "warn", text, fix, about: ABOUT });
  } finally {
    busy.value = "";
  }
}

/**
 * Read a file again as it was chosen: one camera, or each until one is refused.
 * @param {Blob & { name?: string }} file @param {Record<string, string>} before @param {Choice} choice
 */
async function importChosen(file, before, { stated, entries }) {
  for (const one of entries ? entries.map((entry) => ({ entry })) : [{}]) {
    await importFile(file, { ...before, ...stated, ...one });
    if (!imported.value?.kept) return;
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
