// Help beside the work: the manual (help/*.md) and the list of keys, which is the table of actions.
import { Marked } from "marked";
import { useEffect, useRef } from "preact/hooks";
import { ACTIONS, run } from "../../../core/actions.js";
import { html } from "../../../core/html.js";
import { keyLabel, lettersOn, switchLetters } from "../../../core/keys.js";
import { CONTENTS, isUnread, manualPage, openManual, slug } from "../../../core/manual.js";
import { help } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { TourButton } from "./tour.js";

/** The manual's Markdown as HTML; its pictures lie beside its pages. */
const markdown = new Marked({
  walkTokens(token) {
    if (token.type === "image") token.href = `help/${token.href}`;
  },
});

export function Help() {
  useEffect(() => {
    if (help.value === "manual" && isUnread()) void openManual(CONTENTS);
  }, [help.value]);
  return html`<section class="help" aria-label=${t("help.title")} data-testid="help-panel">
    <div class="line help-head">
      <div class="tabs" role="tablist" aria-label=${t("help.title")}>
        <${Tab} id="manual" label=${t("help.tab.manual")} />
        <${Tab} id="keys" label=${t("help.tab.keys")} />
      </div>
      <button type="button" class="close" data-testid="close-help" onClick=${() => run("escape")}>
        ${t("common.close")}
      </button>
    </div>
    ${help.value === "keys" ? html`<${Keys} />` : html`<${Manual} />`}
  </section>`;
}

/** @param {{ id: "manual" | "keys", label: string }} props */
const Tab = ({ id, label }) => html`<button
  type="button"
  role="tab"
  aria-selected=${help.value === id}
  onClick=${() => {
    help.value = id;
  }}
>
  ${label}
</button>`;

function Manual() {
  const article = useRef(/** @type {HTMLElement | null} */ (null));
  const { name, text, heading, asked } = manualPage.value;
  useEffect(() => {
    const pictures = [...(article.current?.querySelectorAll("img") ?? [])];
    for (const picture of pictures.filter((it) => !it.closest("a"))) {
      const inFull = document.createElement("a"); // the panel shows it small
      Object.assign(inFull, { href: picture.src, target: "_blank" });
      picture.replaceWith(inFull);
      inFull.append(picture);
    }
    const all = [...(article.current?.querySelectorAll("h1, h2, h3, h4") ?? [])];
    for (const it of all) it.id = `manual-${slug(it.textContent ?? "")}`;
    const at = /** @type {HTMLElement | undefined} */ (
      all.find((it) => it.id === `manual-${heading}`) ?? all[0]
    );
    if (!at) return;
    at.tabIndex = -1; // so that reading goes on there
    if (heading || asked > 1) at.focus({ preventScroll: true });
    const scroll = () =>
      (heading ? at : (at.closest("aside") ?? at)).scrollIntoView({ block: "start" });
    scroll();
    if (!heading) at.closest("aside")?.scrollTo(0, 0);
    // what is below a picture moves down once it is there
    else
      for (const it of pictures)
        if (!it.complete) it.addEventListener("load", scroll, { once: true });
  }, [text, heading, asked]);
  /** @param {MouseEvent} e */
  const follow = (e) => {
    const link = /** @type {Element} */ (e.target).closest("a")?.getAttribute("href") ?? "";
    if (!/^[\w-]+\.md(#[\w-]+)?$/.test(link)) return;
    e.preventDefault();
    void openManual(link);
  };
  return html`<div class="manual" data-testid="manual" data-page=${name}>
    ${
      name !== CONTENTS
        ? html`<button type="button" onClick=${() => void openManual(CONTENTS)}>
        ${t("help.manual.all-pages")}
      </button>`
        : html`<${TourButton} />`
    }
    <article
      ref=${article}
      lang="en"
      onClick=${follow}
      dangerouslySetInnerHTML=${{ __html: markdown.parse(text, { async: false }) }}
    />
  </div>`;
}

function Keys() {
  const listed = [...ACTIONS.values()].filter((a) => a.keys?.length && a.group);
  return html`<div class="keys" data-testid="keys">
    <label class="line">
      <input
        type="checkbox"
        data-testid="letters"
        checked=${lettersOn.value}
        onChange=${(/** @type {any} */ e) => switchLetters(e.target.checked)}
      />${" "}
      ${t("help.keys.letters")}
    </label>
    ${[...new Set(listed.flatMap((a) => a.group ?? []))].map(
      (group) => html`
      <h3 key=${group}>${t(`help.group.${group}`)}</h3>
      <dl>
        ${listed
          .filter((a) => a.group === group)
          .map(
            (a) => html`<div key=${a.id}>
            <dt>${a.label}</dt>
            <dd>
              ${(a.keys ?? []).slice(0, a.id === "nudge" ? 4 : 2).map(
                (key) => html`
                <kbd key=${key}>${keyLabel(key)}</kbd>${" "}
              `,
              )}
            </dd>
          </div>`,
          )}
      </dl>
    `,
    )}
    <h3>${t("help.mouse.title")}</h3>
    <dl>
      ${[
        [t("help.mouse.add"), t("help.mouse.add.how")],
        [t("help.mouse.move"), t("help.mouse.move.how")],
        [t("help.mouse.free"), t("help.mouse.free.how")],
        [t("help.mouse.line"), t("help.mouse.line.how")],
        [t("help.mouse.several"), t("help.mouse.several.how")],
        [t("help.mouse.zoom"), t("help.mouse.zoom.how")],
        [t("help.mouse.pan"), t("help.mouse.pan.how")],
      ].map(
        ([what, how]) => html`<div key=${what}>
        <dt>${what}</dt>
        <dd>${how}</dd>
      </div>`,
      )}
    </dl>
  </div>`;
}
