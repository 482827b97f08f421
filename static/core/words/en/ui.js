// English: what the parts say that every panel is built from.
export default /** @type {const} */ ({
  "ui.plot.nothing-pointed-at": "no value selected",
  "ui.title.explain": "Explain: {what}",
  "ui.title.explain-this": "Explain this",
});
