// What keys and buttons do to a field that is edited.
import { go } from "../../core/route.js";
import { freeName, isOff, paintedMarks, without } from "./document.js";
import { atEditor, chosen, edit, history, isDirty, isShipped, opened, saving, viewport } from "./editor.js";
import { drawingSize } from "./frame.js";
import { withMoved } from "./geometry.js";
import { saveField } from "./saving.js";

const ZOOM = 1.25;
const NUDGE_MM = 5,
  SHIFT_MM = 50,
  CTRL_MM = 1;
const TOWARDS = /** @type {Record<string, [number, number]>} */ ({
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
});
const isEditing = () => atEditor.value && !isShipped.value;
const canMove = () => isEditing() && chosen.value.some(({ kind }) => kind !== "region");

/** @param {KeyboardEvent} [event] */
function nudge(event) {
  const [x, y] = TOWARDS[event?.key ?? ""] ?? [0, 0],
    by = event?.shiftKey ? SHIFT_MM : event?.ctrlKey || event?.metaKey ? CTRL_MM : NUDGE_MM;
  edit((doc) => withMoved(doc, chosen.value, [x * by, y * by]));
}

/** Choose the next line or arc that is on. @param {1 | -1} way @returns {boolean} whether there was one */
export function chooseNext(way) {
  const doc = history.doc.value;
  if (!doc) return false;
  const all = paintedMarks(doc).filter((mark) => !isOff(doc, mark)),
    last = chosen.value.at(-1),
    at = last ? all.findIndex((m) => m.kind === last.kind && m.name === last.name) : way > 0 ? -1 : all.length;
  const next = all[at + way];
  chosen.value = next ? [next] : [];
  return Boolean(next);
}

/** Put in a new marking and choose it. @param {"line" | "arc" | "landmark" | "region"} kind */
function add(kind) {
  const doc = history.doc.value;
  if (!doc) return;
  const name = freeName(doc, kind === "arc" ? "circle" : kind === "region" ? "part" : kind),
    quarter = Math.round(doc.width_mm / 8),
    width_mm = doc.lines[0]?.width_mm ?? 50;
  edit((d) => {
    if (kind === "line")
      return { ...d, lines: [...d.lines, { name, from: [-quarter, quarter], to: [quarter, quarter], width_mm }] };
    if (kind === "arc")
      return {
        ...d,
        arcs: [...d.arcs, { name, centre: [0, 0], radius_mm: quarter, start_deg: 0, end_deg: 360, width_mm }],
      };
    if (kind === "landmark") return { ...d, landmarks: { ...d.landmarks, [name]: [0, quarter] } };
    const half = [d.length_mm / 4, d.width_mm / 4];
    return { ...d, regions: { ...d.regions, [name]: { x: [-half[0], half[0]], y: [-half[1], half[1]], rotate: 0 } } };
  });
  chosen.value = [{ kind, name }];
}

/** @type {import("../../core/actions.js").Action[]} */
export const FIELD_EDITOR_ACTIONS = [
  {
    id: "new-field",
    label: "Make a new field",
    short: "New field",
    group: "Field editor",
    run: () => go("new-field"),
  },
  {
    id: "copy-field",
    label: "Edit a copy of this field",
    short: "Edit a copy",
    group: "Field editor",
    run: () => go("new-field", { field: opened.value?.name ?? "" }),
    enabled: () => Boolean(opened.value?.name),
  },
  {
    id: "save-field",
    label: "Save the field",
    short: "Save",
    keys: ["ctrl+s"],
    group: "Field editor",
    run: () => void saveField(),
    enabled: () => isEditing() && isDirty.value && !saving.value,
  },
  {
    id: "field-undo",
    label: "Undo in the field editor",
    short: "Undo",
    keys: ["ctrl+z"],
    group: "Field editor",
    run: history.undo,
    enabled: () => isEditing() && history.past.value.length > 0,
  },
  {
    id: "field-redo",
    label: "Redo in the field editor",
    short: "Redo",
    keys: ["ctrl+y", "ctrl+shift+z"],
    group: "Field editor",
    run: history.redo,
    enabled: () => isEditing() && history.future.value.length > 0,
  },
  {
    id: "field-nudge",
    label: "Move the marking by 5 mm; with Shift 50 mm, with Ctrl 1 mm",
    keys: ["", "shift+", "ctrl+"].flatMap((m) => Object.keys(TOWARDS).map((key) => m + key)),
    group: "Field editor",
    run: nudge,
    enabled: canMove,
  },
  {
    id: "field-remove",
    label: "Take the chosen markings off the field",
    short: "Take off",
    keys: ["Delete", "Backspace"],
    group: "Field editor",
    run: () => {
      edit((doc) => without(doc, chosen.value));
      chosen.value = [];
    },
    enabled: () => isEditing() && chosen.value.length > 0,
  },
  {
    id: "next-marking",
    label: "Choose the next marking (on the drawing also Tab)",
    keys: ["n"],
    group: "Field editor",
    run: () => void chooseNext(1),
    enabled: () => atEditor.value,
  },
  {
    id: "previous-marking",
    label: "Choose the previous marking",
    keys: ["b"],
    group: "Field editor",
    run: () => void chooseNext(-1),
    enabled: () => atEditor.value,
  },
  ...["line", "arc", "landmark", "region"].map((kind) => ({
    id: `add-${kind}`,
    label: `Add a ${{ arc: "circle", region: "part that a camera sees" }[kind] ?? kind}`,
    short: `Add ${{ arc: "circle", region: "part" }[kind] ?? kind}`,
    group: "Field editor",
    run: () => add(/** @type {import("./types").MarkKind} */ (kind)),
    enabled: isEditing,
  })),
  {
    id: "field-zoom-out",
    label: "Zoom out of the drawing",
    short: "−",
    keys: ["-"],
    group: "Field editor",
    run: () => viewport.zoomBy(1 / ZOOM),
    enabled: () => atEditor.value,
  },
  {
    id: "field-zoom-in",
    label: "Zoom into the drawing",
    short: "+",
    keys: ["+", "="],
    group: "Field editor",
    run: () => viewport.zoomBy(ZOOM),
    enabled: () => atEditor.value,
  },
  {
    id: "field-zoom-fit",
    label: "Show the whole field",
    short: "Fit",
    keys: ["0"],
    group: "Field editor",
    run: () => {
      if (history.doc.value) viewport.fit(drawingSize(history.doc.value));
    },
    enabled: () => atEditor.value,
  },
];
