// German: the list of pictures that a lens is found or judged by, and what the ways to find a lens say alike.
export default /** @type {const} */ ({
  "lens-pictures.being-uploaded": "Die Bilder werden hochgeladen.",
  "lens-pictures.how-to-add": "Wählen Sie mehrere auf einmal aus oder ziehen Sie sie hierher. PNG, JPEG, BMP oder WebP.",
  "lens-pictures.lens": "Objektiv",
  "lens-pictures.list": "Bilder: {subject}",
  "lens-pictures.list-count": { one: "{count} Bild: {subject}", other: "{count} Bilder: {subject}" },
  "lens-pictures.picture-name": "Bild {number}",
  "lens-pictures.remove": "{name} entfernen",
  "lens-pictures.remove-all": "Alle Bilder entfernen",
  "lens-pictures.remove-picture": "Dieses Bild entfernen",
  "lens-pictures.state.uploaded": "Hochgeladen",
  "lens-pictures.state.uploading": "Wird hochgeladen…",
  "lens-pictures.state.waiting": "Wartet…",
  "lens-pictures.take-one": "Mit {camera} aufnehmen",
  "lens-pictures.waiting-for-camera": "Warten auf die Kamera…",
});
