// The field that is edited: read from the server's, sent back, a blank one, and changes by numbers.
import { areaTitle, lineTitle } from "../../core/format.js";
import { includes, rounded } from "./geometry.js";

/**
 * @typedef {import("../../core/types").Point} Point
 * @typedef {import("../../core/types").Field} Field
 * @typedef {import("./types").FieldDoc} FieldDoc
 * @typedef {import("./types").Mark} Mark
 */

const LINE_MM = 20; // tape

/**
 * Without what the server works out: a region's borders, and what it states.
 * @param {Field} field
 * @returns {FieldDoc}
 */
export function docOf(field) {
  const doc = { ...field };
  delete doc.own;
  delete doc.statements;
  const regions = Object.entries(field.regions).map(([name, { x, y, rotate }]) => [
    name,
    { x, y, rotate },
  ]);
  return { ...doc, regions: Object.fromEntries(regions) };
}

/** What a mark is called. @param {Mark} mark */
export const markTitle = ({ kind, name }) =>
  kind === "region" ? areaTitle(name) : lineTitle(name);

/** What is sent: without what is off. @param {FieldDoc} doc */
export const sentOf = (doc) => ({
  ...doc,
  lines: doc.lines.filter(({ off }) => !off),
  arcs: doc.arcs.filter(({ off }) => !off),
});

/** A field of that size with its borders, a halfway line, a centre line and a circle. @returns {FieldDoc} */
export function blankField(length = 4500, width = 3000) {
  const x = length / 2,
    y = width / 2,
    r = rounded(width / 12);
  const line = (
    /** @type {string} */ name,
    /** @type {Point} */ from,
    /** @type {Point} */ to,
  ) => ({
    name,
    from,
    to,
    width_mm: LINE_MM,
  });
  const region = (/** @type {Point} */ xs, /** @type {Point} */ ys) => ({
    x: xs,
    y: ys,
    rotate: 0,
  });
  return {
    name: "",
    title: "",
    length_mm: length,
    width_mm: width,
    lines: [
      line("touch-line-top", [-x, y], [x, y]),
      line("touch-line-bottom", [-x, -y], [x, -y]),
      line("goal-line-left", [-x, -y], [-x, y]),
      line("goal-line-right", [x, -y], [x, y]),
      line("halfway-line", [0, -y], [0, y]),
      line("centre-line", [-x, 0], [x, 0]),
    ],
    arcs: [
      {
        name: "centre-circle",
        centre: [0, 0],
        radius_mm: r,
        start_deg: 0,
        end_deg: 360,
        width_mm: LINE_MM,
      },
    ],
    landmarks: {
      centre: [0, 0],
      "corner-top-left": [-x, y],
      "corner-top-right": [x, y],
      "corner-bottom-left": [-x, -y],
      "corner-bottom-right": [x, -y],
      "halfway-top": [0, y],
      "halfway-bottom": [0, -y],
      "circle-top": [0, r],
      "circle-bottom": [0, -r],
    },
    regions: {
      full: region([-x, x], [-y, y]),
      "half-left": region([-x, 0], [-y, y]),
      "half-right": region([0, x], [-y, y]),
      "quarter-bottom-left": region([-x, 0], [-y, 0]),
      "quarter-top-left": region([-x, 0], [0, y]),
      "quarter-bottom-right": region([0, x], [-y, 0]),
      "quarter-top-right": region([0, x], [0, y]),
    },
    hat_height_mm: 150,
    line_sigma_mm: 3,
    extras: {},
  };
}

/** A name as the server takes it, of what it is called. @param {string} title */
export const nameOf = (title) =>
  title
    .normalize("NFKD")
    .toLowerCase()
    .replace(/[^a-z0-9]+/g, "-")
    .replace(/^-|-$/g, "")
    .slice(0, 64);

/** The first name of a kind that nothing has. @param {FieldDoc} doc @param {string} stem */
export function freeName(doc, stem) {
  const taken = new Set([
    ...[...doc.lines, ...doc.arcs].map(({ name }) => name),
    ...Object.keys(doc.landmarks),
    ...Object.keys(doc.regions),
  ]);
  for (let i = 1; ; i += 1) if (!taken.has(`${stem}-${i}`)) return `${stem}-${i}`;
}

/** All lines and arcs, in their order, as marks. @param {FieldDoc} doc @returns {Mark[]} */
export const paintedMarks = (doc) => [
  ...doc.lines.map(({ name }) => /** @type {Mark} */ ({ kind: "line", name })),
  ...doc.arcs.map(({ name }) => /** @type {Mark} */ ({ kind: "arc", name })),
];

/** @param {FieldDoc} doc @param {Mark} mark */
export const isOff = (doc, { kind, name }) =>
  (kind === "line" ? doc.lines : kind === "arc" ? doc.arcs : []).some(
    (it) => it.name === name && it.off,
  );

/** Switch a line or an arc on or off.
 * @param {FieldDoc} doc @param {Mark} mark @param {boolean} on @returns {FieldDoc} */
export function switched(doc, { kind, name }, on) {
  const set = (/** @type {any[]} */ all) =>
    all.map((it) => {
      if (it.name !== name) return it;
      const next = { ...it, off: true };
      if (on) delete next.off;
      return next;
    });
  return kind === "line" ? { ...doc, lines: set(doc.lines) } : { ...doc, arcs: set(doc.arcs) };
}

/** Change numbers of a marking or a part.
 * @param {FieldDoc} doc @param {Mark} mark @param {Record<string, unknown>} changes @returns {FieldDoc} */
export function withChanges(doc, { kind, name }, changes) {
  const set = (/** @type {any[]} */ all) =>
    all.map((it) => (it.name === name ? { ...it, ...changes } : it));
  if (kind === "line") return { ...doc, lines: set(doc.lines) };
  if (kind === "arc") return { ...doc, arcs: set(doc.arcs) };
  if (kind === "region")
    return { ...doc, regions: { ...doc.regions, [name]: { ...doc.regions[name], ...changes } } };
  return doc;
}

/** Give a mark another name; its place in the order stays.
 * @param {FieldDoc} doc @param {Mark} mark @param {string} to @returns {FieldDoc} */
export function renamed(doc, { kind, name }, to) {
  const inTable = (/** @type {Record<string, any>} */ table) =>
    Object.fromEntries(
      Object.entries(table).map(([key, value]) => [key === name ? to : key, value]),
    );
  if (kind === "landmark")
    return {
      ...doc,
      landmarks: inTable(doc.landmarks),
      ...marksWith(doc, (mark) => (mark.at === name ? [{ ...mark, at: to }] : [mark])),
    };
  if (kind === "region") return { ...doc, regions: inTable(doc.regions) };
  return withChanges(doc, { kind, name }, { name: to });
}

/** The extras with other dots and crosses, which are painted at landmarks.
 * @param {FieldDoc} doc @param {(mark: any) => any[]} to */
function marksWith({ extras }, to) {
  return Array.isArray(extras.marks)
    ? { extras: { ...extras, marks: extras.marks.flatMap(to) } }
    : {};
}

/** Take marks away for good: landmarks and regions; lines and arcs are switched off.
 * @param {FieldDoc} doc @param {Mark[]} marks @returns {FieldDoc} */
export function without(doc, marks) {
  const kept = (
    /** @type {"landmark" | "region"} */ kind,
    /** @type {Record<string, any>} */ table,
  ) =>
    Object.fromEntries(Object.entries(table).filter(([name]) => !includes(marks, { kind, name })));
  const painted = marks.filter(({ kind }) => kind === "line" || kind === "arc");
  return painted.reduce((now, mark) => switched(now, mark, false), {
    ...doc,
    landmarks: kept("landmark", doc.landmarks),
    ...marksWith(doc, (mark) =>
      includes(marks, { kind: "landmark", name: mark.at }) ? [] : [mark],
    ),
    regions: kept("region", doc.regions),
  });
}

/** Where a refusal's entry stands: "lines[2].to" of what was sent.
 * @param {FieldDoc} doc @param {Mark} mark */
export function entryOf(doc, { kind, name }) {
  if (kind === "landmark" || kind === "region") return `${kind}s.${name}`;
  const all = sentOf(doc)[kind === "line" ? "lines" : "arcs"];
  return `${kind}s[${all.findIndex((it) => it.name === name)}]`;
}

/** Which mark an entry is of. @param {FieldDoc} doc @param {string} entry @returns {Mark | null} */
export function markOf(doc, entry) {
  const inList = /^(line|arc)s\[(\d+)\]/.exec(entry),
    inTable = /^(landmark|region)s\.([^.]+)/.exec(entry);
  if (inTable) return { kind: /** @type {"landmark" | "region"} */ (inTable[1]), name: inTable[2] };
  if (!inList) return null;
  const kind = /** @type {"line" | "arc"} */ (inList[1]),
    it = sentOf(doc)[kind === "line" ? "lines" : "arcs"][Number(inList[2])];
  return it ? { kind, name: it.name } : null;
}
