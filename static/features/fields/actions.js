// What keys and buttons do to a field that is edited.
import { go } from "../../core/route.js";
import { t } from "../../core/words.js";
import { freeName, isOff, paintedMarks, without } from "./document.js";
import {
  atEditor,
  chosen,
  edit,
  history,
  isDirty,
  isShipped,
  opened,
  saving,
  viewport,
} from "./editor.js";
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
    at = last
      ? all.findIndex((m) => m.kind === last.kind && m.name === last.name)
      : way > 0
        ? -1
        : all.length;
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
      return {
        ...d,
        lines: [...d.lines, { name, from: [-quarter, quarter], to: [quarter, quarter], width_mm }],
      };
    if (kind === "arc")
      return {
        ...d,
        arcs: [
          ...d.arcs,
          { name, centre: [0, 0], radius_mm: quarter, start_deg: 0, end_deg: 360, width_mm },
        ],
      };
    if (kind === "landmark") return { ...d, landmarks: { ...d.landmarks, [name]: [0, quarter] } };
    const half = [d.length_mm / 4, d.width_mm / 4];
    return {
      ...d,
      regions: {
        ...d.regions,
        [name]: { x: [-half[0], half[0]], y: [-half[1], half[1]], rotate: 0 },
      },
    };
  });
  chosen.value = [{ kind, name }];
}

/** @type {import("../../core/actions.js").Action[]} */
export const FIELD_EDITOR_ACTIONS = [
  {
    id: "new-field",
    label: t("field-editor.action.new-field.label"),
    short: t("field-editor.action.new-field.short"),
    group: "field-editor",
    run: () => go("new-field"),
  },
  {
    id: "copy-field",
    label: t("field-editor.action.copy-field.label"),
    short: t("field-editor.action.copy-field.short"),
    group: "field-editor",
    run: () => go("new-field", { field: opened.value?.name ?? "" }),
    enabled: () => Boolean(opened.value?.name),
  },
  {
    id: "save-field",
    label: t("field-editor.action.save-field.label"),
    short: t("field-editor.action.save-field.short"),
    keys: ["ctrl+s"],
    group: "field-editor",
    run: () => void saveField(),
    enabled: () => isEditing() && isDirty.value && !saving.value,
  },
  {
    id: "field-undo",
    label: t("field-editor.action.field-undo.label"),
    short: t("common.undo"),
    keys: ["ctrl+z"],
    group: "field-editor",
    run: history.undo,
    enabled: () => isEditing() && history.past.value.length > 0,
  },
  {
    id: "field-redo",
    label: t("field-editor.action.field-redo.label"),
    short: t("common.redo"),
    keys: ["ctrl+y", "ctrl+shift+z"],
    group: "field-editor",
    run: history.redo,
    enabled: () => isEditing() && history.future.value.length > 0,
  },
  {
    id: "field-nudge",
    label: t("field-editor.action.field-nudge.label"),
    keys: ["", "shift+", "ctrl+"].flatMap((m) => Object.keys(TOWARDS).map((key) => m + key)),
    group: "field-editor",
    run: nudge,
    enabled: canMove,
  },
  {
    id: "field-remove",
    label: t("field-editor.action.field-remove.label"),
    short: t("field-editor.action.field-remove.short"),
    keys: ["Delete", "Backspace"],
    group: "field-editor",
    run: () => {
      edit((doc) => without(doc, chosen.value));
      chosen.value = [];
    },
    enabled: () => isEditing() && chosen.value.length > 0,
  },
  {
    id: "next-marking",
    label: t("field-editor.action.next-marking.label"),
    keys: ["n"],
    group: "field-editor",
    run: () => void chooseNext(1),
    enabled: () => atEditor.value,
  },
  {
    id: "previous-marking",
    label: t("field-editor.action.previous-marking.label"),
    keys: ["b"],
    group: "field-editor",
    run: () => void chooseNext(-1),
    enabled: () => atEditor.value,
  },
  .../** @type {const} */ (["line", "arc", "landmark", "region"]).map((kind) => ({
    id: `add-${kind}`,
    label: t(`field-editor.action.add-${kind}.label`),
    short: t(`field-editor.action.add-${kind}.short`),
    group: /** @type {const} */ ("field-editor"),
    run: () => add(kind),
    enabled: isEditing,
  })),
  {
    id: "field-zoom-out",
    label: t("field-editor.action.field-zoom-out.label"),
    short: "−",
    keys: ["-"],
    group: "field-editor",
    run: () => viewport.zoomBy(1 / ZOOM),
    enabled: () => atEditor.value,
  },
  {
    id: "field-zoom-in",
    label: t("field-editor.action.field-zoom-in.label"),
    short: "+",
    keys: ["+", "="],
    group: "field-editor",
    run: () => viewport.zoomBy(ZOOM),
    enabled: () => atEditor.value,
  },
  {
    id: "field-zoom-fit",
    label: t("field-editor.action.field-zoom-fit.label"),
    short: t("field-editor.action.field-zoom-fit.short"),
    keys: ["0"],
    group: "field-editor",
    run: () => {
      if (history.doc.value) viewport.fit(drawingSize(history.doc.value));
    },
    enabled: () => atEditor.value,
  },
];
