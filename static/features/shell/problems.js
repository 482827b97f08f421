// What needs attention, in one list: the bell, the status bar, the wall, the rail and the browser's tab all read it.
import { computed } from "@preact/signals";
import { online } from "../../core/api.js";
import { addressOf } from "../../core/route.js";
import { cameras } from "../../core/state.js";
import { t } from "../../core/words.js";
import { isOver, jobs } from "../jobs/job_list.js";
import { SERVER_GONE, STATES, statuses } from "../live/camera_status.js";
import { contradictions, publishing } from "../network/network.js";
import { rigs } from "../rig/rig.js";
import { health } from "../settings/settings.js";
import { changesInWords } from "../versions/outdated.js";

/**
 * @typedef {object} Problem
 * @property {string} id
 * @property {"bad" | "warn"} level
 * @property {import("../../core/route.js").Place} place where it is mended, "" everywhere
 * @property {string} camera whose it is, else ""
 * @property {string} text
 * @property {string} fix
 * @property {string} href where it is mended, "" nowhere on this page
 */

const FAILED_MS = 3_600_000; // a job that failed longer ago is history
const BROKEN = new Set(["offline", "stalled", "mismatch"]);
/** Whether a camera gives nothing that could be used. @param {string} id */
export const isBroken = (id) => BROKEN.has(statuses.value[id]?.state ?? "");

/** @param {Pick<Problem, "id" | "text"> & Partial<Problem>} known @returns {Problem} */
const problem = (known) => ({ level: "bad", place: "", camera: "", fix: "", href: "", ...known });

/** @returns {Problem[]} */
const ofCameras = () =>
  cameras.value.flatMap(({ id, name }) => {
    const it = statuses.value[id],
      about = { place: /** @type {const} */ ("cameras"), camera: id };
    if (!it || it.problem?.reason === SERVER_GONE) return []; // the server's own entry says so once
    if (isBroken(id))
      return [
        problem({
          ...about,
          id: `camera-${id}`,
          text: `${name}: ${it.problem?.what ?? STATES[it.state]}`,
          fix: it.problem?.fix ?? "",
          href: addressOf("live", { camera: id }),
        }),
      ];
    if (it.drift?.alarm)
      return [
        problem({
          ...about,
          id: `drift-${id}`,
          text: `${name}: ${it.drift.sentence}`,
          fix: it.drift.fix,
          href: addressOf("drift", { camera: id }),
        }),
      ];
    return it.words
      .filter((word) => word.severity === "warning")
      .map((word) =>
        problem({
          ...about,
          id: `light-${id}-${word.text}`,
          level: "warn",
          text: `${name}: ${word.text}`,
          fix: word.fix,
          href: addressOf("live", { camera: id }),
        }),
      );
  });

/** Calibrations that a change of their field has made wrong. @returns {Problem[]} */
const ofFields = () =>
  cameras.value.flatMap(({ id, name, active }) =>
    active?.field_changes.length
      ? [
          problem({
            id: `field-${id}`,
            place: "cameras",
            camera: id,
            text: t("shell.problem.field-changed", { camera: name, changes: changesInWords(active.field_changes) }),
            fix: t("shell.problem.field-changed.fix"),
            href: addressOf("versions", { camera: id }),
          }),
        ]
      : [],
  );

/** @returns {Problem[]} */
function ofPublishing() {
  const it = publishing.value,
    about = { place: /** @type {const} */ ("system"), href: addressOf("publishing") };
  if (!it) return [];
  const found = it.problem
    ? [problem({ ...about, id: "publishing", text: it.problem.what, fix: it.problem.fix })]
    : [];
  for (const { sender, camera } of contradictions.value)
    found.push(
      problem({
        ...about,
        id: `contradiction-${sender.id}-${camera.camera_id}`,
        text: t("shell.problem.contradiction", { address: sender.address, camera: camera.camera_id }),
        fix: t("shell.problem.contradiction.fix"),
      }),
    );
  for (const one of it.cameras) {
    const sharing = it.cameras.filter((c) => c.field === one.field && c.camera_id === one.camera_id);
    if (sharing.length > 1 && sharing[0] === one)
      found.push(
        problem({
          ...about,
          id: `number-${one.camera_id}`,
          level: "warn",
          text: t("shell.problem.same-number", {
            cameras: sharing.map((c) => nameOf(c.camera)).join(t("shell.problem.same-number.and")),
            number: one.camera_id,
          }),
          fix: t("shell.problem.same-number.fix"),
        }),
      );
  }
  return found;
}

/** @param {string} id */
const nameOf = (id) => cameras.value.find((c) => c.id === id)?.name ?? id;

/** @returns {Problem[]} */
const ofRigs = () =>
  rigs.value.flatMap((rig) =>
    rig.cameras.flatMap(({ camera, troubles }) =>
      troubles.map(({ reason, text, fix }) =>
        problem({
          id: `rig-${rig.name}-${camera}-${reason}`,
          level: "warn",
          place: "field",
          text,
          fix,
          href: addressOf("rig", { rig: rig.name }),
        }),
      ),
    ),
  );

/** @returns {Problem[]} */
const ofJobs = () => {
  const failed = (jobs.value ?? []).filter(
    (job) => isOver(job) && job.state === "failed" && Date.now() - Date.parse(job.ended_at ?? "") < FAILED_MS,
  );
  if (!failed.length) return [];
  const text = t("shell.problem.jobs-failed", { count: failed.length });
  return [problem({ id: "jobs", level: "warn", place: "system", text, href: addressOf("jobs") })];
};

/** @returns {Problem[]} */
const ofLine = () =>
  online.value
    ? []
    : [
        problem({
          id: "away",
          text: t("common.server-silent"),
          fix: t("shell.problem.away.fix"),
        }),
      ];

/** What the server says of itself: its disk, its network, and records that were damaged. */
export const serverProblems = computed(() => [
  ...(health.value?.warnings ?? []).map(({ reason, text, fix }) =>
    problem({ id: reason, level: "warn", place: "system", text, fix, href: addressOf("server") }),
  ),
  ...(health.value?.damaged ?? []).map(({ kind, file, note, fix }) =>
    problem({
      id: `damaged-${file}`,
      place: "system",
      text: note === null ? t("shell.problem.damaged", { kind, file }) : t("shell.problem.set-aside", { file }),
      fix: note ?? fix,
      href: addressOf("server"),
    }),
  ),
]);

/** All of them, what stops a match first. */
export const problems = computed(() =>
  [
    ...ofLine(),
    ...serverProblems.value,
    ...ofCameras(),
    ...ofFields(),
    ...ofPublishing(),
    ...ofRigs(),
    ...ofJobs(),
  ].toSorted((a, b) => Number(b.level === "bad") - Number(a.level === "bad")),
);

/** Of the camera that stops a match, if one does. */
export const badCamera = computed(() => {
  const found = problems.value.find((it) => it.level === "bad" && it.camera);
  return found ? { name: nameOf(found.camera), href: found.href } : null;
});

/** The worst of a place or a camera. @param {(it: Problem) => boolean} isOf */
export const worstOf = (isOf) => problems.value.find(isOf)?.level ?? null;
