// German: what the parts say that every panel is built from.
export default /** @type {const} */ ({
  "ui.plot.nothing-pointed-at": "kein Wert ausgewählt",
  "ui.title.explain": "Erklärung: {what}",
  "ui.title.explain-this": "Erklärung anzeigen",
});
