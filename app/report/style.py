"""How the page looks: dark text on white, A4, nothing that is split across two sheets. Without a script or a font."""

CSS = """
@page { size: A4; margin: 14mm 13mm; }
* { box-sizing: border-box; }
html { background: #fff; color: #141a17; font: 10.5pt/1.45 system-ui, "Segoe UI", "Helvetica Neue", Arial, sans-serif;
  -webkit-print-color-adjust: exact; print-color-adjust: exact; }
body { max-width: 184mm; margin: 0 auto; padding: 8mm 4mm; overflow-wrap: anywhere; }
h1 { font-size: 19pt; line-height: 1.2; margin: 0 0 1mm; }
h2 { font-size: 12.5pt; margin: 8mm 0 2mm; padding-bottom: .8mm; border-bottom: .3mm solid #c4ccc8;
  break-after: avoid; }
p { margin: 0 0 2mm; }
.dim, td small, figcaption { color: #4a544f; }
.verdict { margin: 4mm 0; padding: 3mm 4mm; border: .5mm solid #4a544f; border-left-width: 3mm; border-radius: 1.5mm;
  break-inside: avoid; }
.verdict b { font-size: 13pt; }
.verdict p { margin: 0; }
.good { border-color: #1b7f4b; } .fair { border-color: #a86a00; } .poor { border-color: #b3261e; }
.unknown { border-color: #4a544f; }
table { width: 100%; border-collapse: collapse; font-size: 9.5pt; }
th, td { text-align: left; vertical-align: top; padding: .9mm 3mm .9mm 0; border-bottom: .15mm solid #dde3e0; }
th { font-weight: 600; } thead th { color: #4a544f; font-weight: 500; }
thead { display: table-header-group; }
tr { break-inside: avoid; }
th[scope] { min-width: 36mm; }
td.number, th.number { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums; }
.reading { color: #4a544f; }
figure { margin: 2mm 0 5mm; break-inside: avoid; }
figcaption { font-size: 9pt; margin-top: 1.2mm; }
svg.photograph { display: block; width: 100%; max-height: 205mm; overflow: hidden; }
.maps { display: flex; flex-wrap: wrap; gap: 4mm; }
.maps figure { flex: 1 1 80mm; margin: 0; max-width: 100%; }
.maps img { display: block; max-width: 100%; }
.missing { padding: 2mm 3mm; background: #f2f4f3; border-radius: 1mm; }
ul { margin: 0; padding-left: 5mm; } li { margin-bottom: 1.5mm; break-inside: avoid; }
code, pre { font: 7.8pt/1.4 ui-monospace, "DejaVu Sans Mono", Consolas, monospace; }
pre { white-space: pre-wrap; margin: 1mm 0; padding: 2mm 3mm; background: #f2f4f3; }
@media print { .screen { display: none; } body { max-width: none; padding: 0; } }
"""
