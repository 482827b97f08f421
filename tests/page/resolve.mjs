// Finds what the page's modules import by a bare name where the page's import map has it: in static/vendor.
import { readFileSync } from "node:fs";
import { registerHooks } from "node:module";

const page = new URL("../../static/", import.meta.url);
const [, map] = /<script type="importmap">(.*?)<\/script>/s.exec(
  readFileSync(new URL("index.html", page), "utf8"),
);
const { imports } = JSON.parse(map);

registerHooks({
  resolve(name, context, next) {
    const found = next(name in imports ? new URL(imports[name], page).href : name, context);
    return found.url.startsWith(page.href) ? { ...found, format: "module" } : found;
  },
});
