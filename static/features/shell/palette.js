// What Ctrl K finds: places, cameras with their tabs, fields, versions, images, manual pages and every action that can
// be done.
import { computed, signal } from "@preact/signals";
import { ACTIONS, run } from "../../core/actions.js";
import { call } from "../../core/api.js";
import { dayAndTime } from "../../core/format.js";
import { keyLabel } from "../../core/keys.js";
import { CONTENTS, openManual } from "../../core/manual.js";
import { addressOf } from "../../core/route.js";
import { cameras, fields, snapshots } from "../../core/state.js";
import { t } from "../../core/words.js";
import { PLACES, tabsOf } from "./places.js";

const SHOWN = 40,
  VERSIONS = 50;
/** @typedef {{ kind: string, label: string, hint?: string, run: () => void }} Entry */

/** Whether it is open, and what is looked for. */
export const isOpen = signal(false);
export const wanted = signal("");
/** What is not at hand before it is opened: versions, and the manual's pages. */
const fetched = signal(/** @type {Entry[]} */ ([]));

/** @param {string} kind @param {string} label @param {string} address @returns {Entry} */
const to = (kind, label, address) => ({
  kind,
  label,
  run: () => {
    location.hash = address;
  },
});

/** @returns {Entry[]} */
const ofPlaces = () =>
  PLACES.flatMap(({ place, view, label }) =>
    (place === "cameras" ? [/** @type {const} */ ([view, ""])] : tabsOf(place))
      .filter(([tab]) => tab !== "ball") // it rolls before a camera
      .map(([tab, name]) =>
        to(t("shell.palette.kind.place"), name ? `${label}: ${name}` : label, addressOf(tab)),
      ),
  );

/** @returns {Entry[]} */
const ofCameras = () =>
  cameras.value.flatMap(({ id, name }) =>
    tabsOf("cameras").map(([tab, label]) =>
      to(t("shell.palette.kind.camera"), `${name}: ${label}`, addressOf(tab, { camera: id })),
    ),
  );

/** @returns {Entry[]} */
const ofFields = () =>
  fields.value.map(({ name, title }) =>
    to(t("shell.palette.kind.field"), title, addressOf("field-editor", { field: name })),
  );

/** @returns {Entry[]} */
const ofImages = () =>
  snapshots.value.map((s) => {
    const of = cameras.value.find((c) => c.id === s.camera)?.name,
      name = of || s.name || t("shell.palette.file");
    return to(
      t("shell.palette.kind.image"),
      `${name}, ${dayAndTime(s.taken_at)}`,
      addressOf("calibrate", { picture: s.id, step: "points" }),
    );
  });

/** @returns {Entry[]} */
const ofActions = () =>
  [...ACTIONS.values()]
    .filter((a) => a.id !== "palette" && (a.enabled?.() ?? true))
    .map((a) => ({
      kind: t("shell.palette.kind.do"),
      label: a.label,
      hint: a.keys?.[0] && keyLabel(a.keys[0]),
      run: () => run(a.id),
    }));

/** Those that have every word that was typed, in the order of their kinds. */
export const results = computed(() => {
  const parts = wanted.value.toLowerCase().split(/\s+/).filter(Boolean);
  if (!isOpen.value) return [];
  const all = [
    ...ofPlaces(),
    ...ofCameras(),
    ...ofActions(),
    ...ofFields(),
    ...ofImages(),
    ...fetched.value,
  ];
  return all
    .filter(({ kind, label }) =>
      parts.every((part) => `${kind} ${label}`.toLowerCase().includes(part)),
    )
    .slice(0, SHOWN);
});

/** Open it, empty. */
export function openPalette() {
  wanted.value = "";
  isOpen.value = true;
  void Promise.all([fetchVersions(), fetchManual()]).then((found) => {
    fetched.value = found.flat();
  });
}

/** @returns {Promise<Entry[]>} */
const fetchVersions = () =>
  call("GET", `/calibrations?brief=true&limit=${VERSIONS}`).then(
    ({ items }) =>
      items
        .filter((/** @type {any} */ v) => v.snapshot)
        .map((/** @type {any} */ v) => {
          const name =
            cameras.value.find((c) => c.id === v.camera)?.name ?? t("shell.palette.file");
          const address = addressOf("calibrate", { picture: v.snapshot, step: "verify" });
          const key = v.active ? "shell.palette.version-active" : "shell.palette.version";
          return to(
            t("shell.palette.kind.version"),
            t(key, { camera: name, version: v.version }),
            address,
          );
        }),
    () => [],
  );

/** The pages that the manual's contents list. @returns {Promise<Entry[]>} */
const fetchManual = () =>
  fetch(`help/${CONTENTS}`)
    .then((answer) => (answer.ok ? answer.text() : ""))
    .then(
      (text) =>
        [...text.matchAll(/^- \[(.+)\]\(([\w-]+\.md)\)$/gm)].map(([, label, page]) => ({
          kind: t("shell.palette.kind.manual"),
          label,
          run: () => void openManual(page),
        })),
      () => [],
    );
