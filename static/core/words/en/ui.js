// English: what the parts say that every panel is built from.
export default /** @type {const} */ ({
  "ui.later": "This part of the page could not be loaded.",
  "ui.later.fix": "Check that the server is running, then reload the page. Points are saved.",
  "ui.length.not-a-length": "“{typed}” is not a length. Enter it like 5200, 5.2 m or 520 cm.",
  "ui.length.understood-cm": "{typed} → {mm} mm: understood as centimetres",
  "ui.length.understood-m": "{typed} → {mm} mm: understood as metres",
  "ui.length.understood-mm": "{typed} → {mm} mm",
  "ui.plot.nothing-pointed-at": "no value selected",
  "ui.title.explain": "Explain: {what}",
  "ui.title.explain-this": "Explain this",
});
