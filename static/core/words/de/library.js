// German: the images that were worked on.
export default /** @type {const} */ ({
  "library.calibrate-camera.how": "Nehmen Sie ein Bild auf und kalibrieren Sie damit, oder arbeiten Sie mit einem früheren weiter. Das Feld muss dabei frei von Personen sein; andernfalls nehmen Sie nur den Hintergrund auf.",
  "library.earlier-pictures": "Neueste Bilder",
  "library.go-on-with": "Weiter mit dem Bild vom",
  "library.images": "Bilder",
  "library.newest-first": "Bilder, neueste zuerst",
  "library.no-image": "Noch kein Bild",
  "library.show-older": "Ältere Bilder anzeigen",
});
