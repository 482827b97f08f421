// German: what the parts say that every panel is built from.
export default /** @type {const} */ ({
  "ui.later": "Dieser Teil der Seite konnte nicht geladen werden.",
  "ui.later.fix": "Prüfen Sie, ob der Server läuft, und laden Sie die Seite dann neu. Punkte sind gespeichert.",
  "ui.length.not-a-length": "„{typed}“ ist keine Länge. Geben Sie sie so ein: 5200, 5,2 m oder 520 cm.",
  "ui.length.understood-cm": "{typed} → {mm} mm: als Zentimeter verstanden",
  "ui.length.understood-m": "{typed} → {mm} mm: als Meter verstanden",
  "ui.length.understood-mm": "{typed} → {mm} mm",
  "ui.plot.nothing-pointed-at": "kein Wert ausgewählt",
  "ui.title.explain": "Erklärung: {what}",
  "ui.title.explain-this": "Erklärung anzeigen",
});
