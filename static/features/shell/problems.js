// What needs attention, in one list: the bell, the status bar, the wall, the rail and the browser's tab all read it.
import { computed } from "@preact/signals";
import { online } from "../../core/api.js";
import { addressOf } from "../../core/route.js";
import { cameras } from "../../core/state.js";
import { t } from "../../core/words.js";
import { isOver, jobs } from "../jobs/job_list.js";
import { statuses } from "../live/camera_status.js";
import { health } from "../settings/settings.js";
import { addressOfCure, markOf } from "../verify/claims.js";
import { readiness } from "./readiness.js";

/**
 * @typedef {object} Problem
 * @property {string} id
 * @property {"bad" | "warn"} level
 * @property {import("../../core/route.js").Place} place where it is mended
 * @property {string} camera whose it is, else ""
 * @property {string} text
 * @property {string} fix
 * @property {string} href where it is mended, "" nowhere on this page
 */

const FAILED_MS = 3_600_000; // a job that failed longer ago is history
const PLACES = /** @type {const} */ ({ rig: "field", pair: "field", publishing: "system" });

/** @param {Pick<Problem, "id" | "text"> & Partial<Problem>} known @returns {Problem} */
const problem = (known) => ({
  level: "bad",
  place: "system",
  camera: "",
  fix: "",
  href: "",
  ...known,
});

/**
 * What the server knows to be wrong: what stands against a match, and the rest where it says what to do.
 * @returns {Problem[]}
 */
const ofSite = () =>
  (readiness.value?.items ?? [])
    .filter(({ state, gates, cases }) => state === "refuted" && (gates || cases.length))
    .flatMap(({ cases, ...claim }) =>
      (cases.length ? cases : [{ ...claim, text: inOne(claim) }]).map(({ text, fix, camera }) =>
        problem({
          id: `${claim.code}-${camera ?? text}`,
          level: markOf(claim) === "bad" ? "bad" : "warn",
          place: PLACES[/** @type {keyof typeof PLACES} */ (claim.cure)] ?? "cameras",
          camera: camera ?? "",
          text,
          fix,
          href: addressOfCure({ ...claim, camera }),
        }),
      ),
    );

/** @param {{ title: string, evidence: string }} claim */
const inOne = ({ title, evidence }) => (evidence ? `${title}. ${evidence}` : `${title}.`);

/** What a live image says of the light and the lens. @returns {Problem[]} */
const ofImages = () =>
  cameras.value.flatMap(({ id, name }) =>
    (statuses.value[id]?.words ?? [])
      .filter((word) => word.severity === "warning")
      .map((word) =>
        problem({
          id: `light-${id}-${word.text}`,
          level: "warn",
          place: "cameras",
          camera: id,
          text: `${name}: ${word.text}`,
          fix: word.fix,
          href: addressOf("live", { camera: id }),
        }),
      ),
  );

/** @returns {Problem[]} */
const ofJobs = () => {
  const failed = (jobs.value ?? []).filter(
    (job) =>
      isOver(job) &&
      job.state === "failed" &&
      Date.now() - Date.parse(job.ended_at ?? "") < FAILED_MS,
  );
  if (!failed.length) return [];
  const text = t("shell.problem.jobs-failed", { count: failed.length });
  return [problem({ id: "jobs", level: "warn", text, href: addressOf("jobs") })];
};

const AWAY = problem({
  id: "away",
  text: t("common.server-silent"),
  fix: t("shell.problem.away.fix"),
});

/** What has become of it: its note says that. @param {string} kind @param {string | null} note */
const whatOf = (kind, note) =>
  note !== null ? "set-aside" : kind === "missing" ? "missing" : "damaged";

/** What the server says of itself: its disk, its network, and records that were damaged. @returns {Problem[]} */
const ofServer = () => [
  ...(health.value?.warnings ?? []).map(({ reason, text, fix }) =>
    problem({ id: reason, level: "warn", text, fix, href: addressOf("server") }),
  ),
  ...(health.value?.damaged ?? []).map(({ kind, file, note, fix }) =>
    problem({
      id: `damaged-${file}`,
      text: t(`shell.problem.${whatOf(kind, note)}`, { kind, file }),
      fix: note ?? fix,
      href: addressOf("server"),
    }),
  ),
];

/** All of them, what stops a match first; what several say is said once. */
export const problems = computed(() => {
  const found = online.value ? [...ofSite(), ...ofServer()] : [AWAY, ...ofServer()];
  const all = [...found, ...ofImages(), ...ofJobs()];
  return all
    .filter(({ text }, i) => all.findIndex((it) => it.text === text) === i)
    .toSorted((a, b) => Number(b.level === "bad") - Number(a.level === "bad"));
});

/** Of the camera that stops a match, if one does. */
export const badCamera = computed(() => {
  const found = problems.value.find((it) => it.level === "bad" && it.camera);
  return found ? { name: nameOf(found.camera), href: found.href } : null;
});

/**
 * What the bell, the status bar and the rail show: how many, how bad, and the worst itself.
 * @typedef {{ count: number, level: "bad" | "warn" | "ok" | "unknown", worst: Problem | null }} Summary
 */

/** Before the server has said what it knows, nothing is called good. @param {Problem[]} some in their order
 * @returns {Summary} */
const summaryOf = (some) => ({
  count: some.length,
  level: some[0]?.level ?? (readiness.value ? "ok" : "unknown"),
  worst: some[0] ?? null,
});

/** What the summary says where there is no problem. */
export const noProblem = computed(() =>
  readiness.value ? t("shell.problems.none") : t("common.asking"),
);

/** Of all problems. */
export const summary = computed(() => summaryOf(problems.value));

/** Of those of one place of the rail; all places together have all of them. @param {string} place */
export const summaryOfPlace = (place) =>
  summaryOf(problems.value.filter((it) => it.place === place));

/** @param {string} id */
const nameOf = (id) => cameras.value.find((c) => c.id === id)?.name ?? id;
