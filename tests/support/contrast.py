"""Contrast of what is not text: a control's edge, and the mark of one that is pressed (WCAG 2.1, 1.4.11)."""

ENOUGH = 3.0
# Each control that can be used and is seen, whose edge or pressed mark is too faint before what is behind it; one
# that is filled needs no edge. Luminance and ratio as WCAG defines them.
FAINT = """(enough) => {
  const rgb = (text) => (text.match(/rgba?\\(([^)]*)\\)/) ?? ["", "0 0 0 0"])[1].split(/[ ,/]+/).map(Number);
  const opaque = (c) => c.length < 4 || c[3] > 0.99;
  const behind = (e) => {
    for (; e; e = e.parentElement) {
      const c = rgb(getComputedStyle(e).backgroundColor);
      if (opaque(c)) return c;
    }
    return [255, 255, 255];
  };
  const linear = (v) => (v / 255 <= 0.04045 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4);
  const luminance = ([r, g, b]) => 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b);
  const ratio = (a, b) => {
    const [dark, bright] = [luminance(a), luminance(b)].sort((p, q) => p - q);
    return (bright + 0.05) / (dark + 0.05);
  };
  const controls = document.querySelectorAll("button, .as-button, select, input[type=text], input[type=number]");
  return [...controls].filter((e) => e.checkVisibility({ visibilityProperty: true }) && !e.disabled
                                     && e.getAttribute("aria-disabled") !== "true").flatMap((e) => {
    const style = getComputedStyle(e), ground = behind(e.parentElement), own = rgb(style.backgroundColor);
    const edge = rgb(style.borderTopColor), name = `${e.dataset.testid ?? e.className} ${e.textContent.trim()}`;
    const found = [], isFilled = opaque(own) && ratio(own, ground) >= enough;
    if (parseFloat(style.borderTopWidth) && opaque(edge) && !isFilled && ratio(edge, ground) < enough)
      found.push(`${name.slice(0, 60)}: edge ${ratio(edge, ground).toFixed(2)}`);
    if (e.getAttribute("aria-pressed") === "true") {
      const outline = style.outlineStyle === "none" ? "" : style.outlineColor;
      const marks = [style.boxShadow, outline, style.borderTopColor].map(rgb).filter(opaque);
      const best = Math.max(0, ...marks.map((mark) => ratio(mark, behind(e))));
      if (best < enough) found.push(`${name.slice(0, 60)}: pressed ${best.toFixed(2)}`);
    }
    return found;
  });
}"""


def faint_controls(page) -> list[str]:
    """Controls on the page as it stands whose edge or pressed state has a contrast under 3 : 1, one line each."""
    return page.evaluate(FAINT, ENOUGH)
