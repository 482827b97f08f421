// German: the check of a calibration against the current image.
export default /** @type {const} */ ({
  "check.action.check": "Aktive Kalibrierung am aktuellen Bild prüfen",
  "check.action.check.short": "Kalibrierung prüfen",
  "check.action.stop": "Prüfung der Kalibrierung stoppen",
  "check.checking": "Kalibrierung wird geprüft",
  "check.not-told": "Nicht eindeutig",
  "check.picture": "Geprüftes Bild",
  "check.picture.caption": "Weiß: Linien an ihren Positionen in Version {version}. Farbig: erkannte Linien, rot bei einer Abweichung über {limit} mm.",
  "check.picture.lines": "Kalibrierte und erkannte Positionen der Feldlinien",
  "check.table.explained": "mm: Abstand (RMS) der erkannten Linie von ihrer Position in Version {version}, auf dem Teppich quer zur Linie gemessen.",
  "check.table.found": "Erkannt",
  "check.table.line": "Linie",
  "check.table.worst": "Größter Wert",
  "check.title": "Prüfung der Kalibrierung",
  "check.what-it-does": "Vergleicht die aktive Version mit dem aktuellen Bild. Zeigt, wie weit jede Feldlinie von ihrer kalibrierten Position abweicht.",
});
