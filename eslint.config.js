/* What eslint checks in the page's JavaScript. prettier says how lines break, tsc whether names and types exist. */

import js from "@eslint/js";

const PAGE = "marsupial/replay";

/** The folders of modules; each imports from itself and those before it (marsupial/replay/page.py). */
const LAYERS = ["log", "text", "draw", "page", "live"];

/** Folders that know values only, no page. */
const WITHOUT_PAGE = ["log", "text"];

function boundary(layer, i) {
  const above = LAYERS.slice(i + 1);
  const patterns = [{ regex: "^\\.", message: `Import by name: "#${layer}/...".` }];
  if (above.length) patterns.push({ regex: `^#(${above.join("|")})/`, message: `${layer}/ is below that folder.` });
  return { files: [`${PAGE}/${layer}/*.js`], rules: { "no-restricted-imports": ["error", { patterns }] } };
}

export default [
  { linterOptions: { reportUnusedDisableDirectives: "error" } },
  js.configs.recommended,
  {
    rules: {
      curly: ["error", "multi-line"],
      eqeqeq: "error",
      "max-len": ["error", { code: 120 }],
      "max-lines": ["error", 400],
      "no-shadow": "error",
      "no-undef": "off", // tsc does it, and knows what browsers have
      "no-unused-vars": ["error", { args: "after-used", argsIgnorePattern: "^_" }],
      "no-var": "error",
      "object-shorthand": "error",
      "prefer-const": "error",
    },
  },
  ...LAYERS.map(boundary),
  {
    files: WITHOUT_PAGE.map((layer) => `${PAGE}/${layer}/*.js`),
    rules: { "no-restricted-globals": ["error", "document", "window"] },
  },
];
