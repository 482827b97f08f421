// Help beside the work: the manual (help/*.md) and the list of keys, which is the table of actions.
import { signal } from "@preact/signals";
import { marked } from "marked";
import { useEffect } from "preact/hooks";
import { ACTIONS, run } from "../actions.js";
import { html } from "../html.js";
import { printed } from "../keys.js";
import { help } from "../state.js";

const FIRST = "contents.md";
const page = signal({ name: FIRST, text: "" });

/** @param {string} name */
async function open(name) {
  try {
    const response = await fetch(`help/${name}`);
    page.value = { name, text: response.ok ? await response.text() : `There is no page called ${name}.` };
  } catch {
    page.value = { name, text: "The manual cannot be read while the server does not answer." };
  }
}

export function Help() {
  useEffect(() => { if (help.value === "manual" && !page.value.text) void open(FIRST); }, [help.value]);
  return html`<section class="help" aria-label="Help" data-testid="help-panel">
    <div class="tabs" role="tablist"><${Tab} id="manual" label="Manual"/><${Tab} id="keys" label="Keys"/>
      <button type="button" class="close" data-testid="close-help" onClick=${() => run("escape")}>Close</button></div>
    ${help.value === "keys" ? html`<${Keys}/>` : html`<${Manual}/>`}</section>`;
}

/** @param {{ id: "manual" | "keys", label: string }} props */
const Tab = ({ id, label }) => html`<button type="button" role="tab" aria-selected=${help.value === id} onClick=${() => { help.value = id; }}>${label}</button>`;

function Manual() {
  /** @param {MouseEvent} e */
  const follow = (e) => {
    const link = /** @type {Element} */ (e.target).closest("a")?.getAttribute("href") ?? "";
    if (!/^[\w-]+\.md$/.test(link)) return;
    e.preventDefault();
    void open(link);
  };
  return html`<div class="manual" data-testid="manual">
    ${page.value.name !== FIRST && html`<button type="button" onClick=${() => void open(FIRST)}>← Show all pages</button>`}
    <article onClick=${follow} dangerouslySetInnerHTML=${{ __html: marked.parse(page.value.text, { async: false }) }}/></div>`;
}

function Keys() {
  const listed = [...ACTIONS.values()].filter((a) => a.keys?.length && a.group);
  return html`<div class="keys" data-testid="keys">${[...new Set(listed.map((a) => a.group))].map((group) => html`<h3 key=${group}>${group}</h3>
    <dl>${listed.filter((a) => a.group === group).map((a) => html`<div key=${a.id}><dt>${a.label}</dt>
      <dd>${(a.keys ?? []).slice(0, a.id === "nudge" ? 4 : 2).map((key) => html`<kbd key=${key}>${printed(key)}</kbd> `)}</dd></div>`)}</dl>`)}
    <h3>Mouse and fingers</h3><dl>${[["Add a point", "click, tap"], ["Move a point", "drag; the loupe shows raw pixels"], ["Select several", "Shift drag, Ctrl click"],
      ["Zoom", "wheel, two fingers"], ["Pan", "Space drag, middle button, two fingers"]].map(([what, how]) => html`<div key=${what}><dt>${what}</dt><dd>${how}</dd></div>`)}</dl></div>`;
}
